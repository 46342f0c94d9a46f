//! News from other threads: frames, answers to questions, errors against the path tracer, recompiled GLSL. Lost
//! devices, that of the window and that of the frames, are reopened, because a reset driver loses every device at once.
//! A device that is lost again soon is not reopened.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::anyhow;

use super::App;
use super::job::{News, ShownFrame};
use crate::cli::out;
#[cfg(feature = "hot-reload")]
use crate::say;

/// A device that is lost again within this time stays lost.
const AGAIN: Duration = Duration::from_secs(10);

impl App {
    pub(super) fn take(&mut self, news: News) -> anyhow::Result<()> {
        match news {
            News::Frame => {
                let frame = self.worker.as_ref().and_then(|worker| worker.shared.lock().frame.take());
                if let Some((revision, frame)) = frame.filter(|(revision, _)| *revision >= self.first) {
                    self.take_frame(revision, frame)?;
                }
            }
            News::Found(revision, found) if revision >= self.first => {
                self.panel.take(found);
                self.script.found();
            }
            News::Compared(cancelled, compared) if !cancelled.load(Ordering::Relaxed) => self.compared = Some(compared),
            #[cfg(feature = "hot-reload")]
            News::Shaders(said) => self.take_shaders(said),
            _ => {} // from an ended worker, or for a frame that is no longer shown
        }
        Ok(())
    }

    fn take_frame(&mut self, revision: u64, frame: Result<ShownFrame, String>) -> anyhow::Result<()> {
        self.answered = revision;
        self.whole = frame.as_ref().map_or(true, |frame| frame.whole);
        match frame {
            Err(_) if self.context.is_lost() => self.renew_context()?,
            Err(words) => match self.before.take() {
                // The last opened scene cannot be shown, so the previous one is restored.
                Some((subject, settings, eye, later_s)) => {
                    (self.subject, self.eye, self.later_s) = (subject, eye, later_s);
                    self.panel.choice.settings = settings;
                    self.panel.error = Some(words);
                    self.start()?;
                }
                None if self.frame.is_none() => return Err(anyhow!(words)),
                None => self.panel.frame_error = Some(words),
            },
            Ok(frame) => {
                (self.before, self.panel.frame_error) = (None, None);
                if let Some(job) = self.asked.as_ref().filter(|job| job.revision == revision) {
                    self.script.answered(self.asked_at.elapsed());
                    self.script.unfinished += u32::from(!job.moving && !frame.whole);
                }
                (self.truth, self.compared, self.mixed) = (None, None, None);
                self.panel.history.add(&frame);
                self.set_title(&frame);
                self.frame = Some(frame);
            }
        }
        Ok(())
    }

    /// Shows the result of saved GLSL.
    #[cfg(feature = "hot-reload")]
    fn take_shaders(&mut self, said: Result<usize, String>) {
        self.script.reloaded();
        self.panel.shader_error = said.as_ref().err().cloned();
        match said {
            Ok(count) => {
                say!("shaders compiled anew: {count}");
                if count > 0 {
                    self.shaders += 1;
                    self.moves();
                }
            }
            Err(words) => out::warn(&words),
        }
    }

    /// Reopens the window's device if it was lost; otherwise returns the error.
    pub(super) fn recover(&mut self, error: anyhow::Error) -> anyhow::Result<()> {
        let Some(shown) = self.shown.take_if(|shown| shown.screen.context().is_lost()) else { return Err(error) };
        note_loss(&mut self.lost.window, "the window's device")?;
        shown.screen.close()?; // the window supports one swapchain at a time
        self.show_in(shown.window)?;
        self.redraw();
        Ok(())
    }

    /// Reopens the device of the frames, and starts over.
    pub(super) fn renew_context(&mut self) -> anyhow::Result<()> {
        note_loss(&mut self.lost.frames, &self.context.name)?;
        self.worker = None; // its work is lost with the device
        self.context = self.run.device.open(self.subject.args.size)?;
        self.start()
    }

    fn set_title(&self, frame: &ShownFrame) {
        let Some(shown) = &self.shown else { return };
        let (width, height) = shown.screen.size();
        let coarse = if frame.divisor > 1 { format!(" at 1/{}", frame.divisor) } else { String::new() };
        let (name, ms, refined) = (&self.subject.scene.name, frame.ms, frame.refined());
        let title = format!("{name} · {width}x{height}{coarse} · {ms:.0} ms{refined} · {}", self.context.name);
        shown.window.set_title(&title);
    }
}

/// The times at which devices were last reopened.
#[derive(Default)]
pub struct Losses {
    window: Option<Instant>,
    frames: Option<Instant>,
}

fn note_loss(last: &mut Option<Instant>, what: &str) -> anyhow::Result<()> {
    if last.is_some_and(|at| at.elapsed() < AGAIN) {
        let remedy = "ask for less, such as a smaller window";
        return Err(anyhow!("{what} was lost again, soon after it was reopened: {remedy}"));
    }
    *last = Some(Instant::now());
    out::warn(&format!("{what} was lost and is reopened"));
    Ok(())
}
