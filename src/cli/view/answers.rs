//! What comes back from other threads: frames, answers to questions, GLSL that was compiled anew.

use anyhow::anyhow;

use super::App;
#[cfg(feature = "hot-reload")]
use super::reload;
use super::worker::Worker;
#[cfg(feature = "hot-reload")]
use crate::cli::out;
#[cfg(feature = "hot-reload")]
use crate::say;

impl App {
    pub(super) fn take_answer(&mut self) -> anyhow::Result<()> {
        if let Some(found) = self.worker.as_ref().and_then(Worker::found) {
            self.panel.take(found);
            self.script.found();
        }
        let Some(answer) = self.worker.as_ref().and_then(Worker::answer) else { return Ok(()) };
        self.answered = answer.revision;
        self.whole = answer.frame.as_ref().map_or(true, |frame| frame.refined.whole);
        match answer.frame {
            Err(_) if self.context.is_lost() => self.renew_context()?,
            Err(words) => match self.before.take() {
                // What was opened last cannot be shown.
                Some((subject, settings, eye, later_s)) => {
                    (self.subject, self.eye, self.later_s) = (subject, eye, later_s);
                    self.panel.settings = settings;
                    self.panel.error = Some(words);
                    self.start();
                }
                None if self.frame.is_none() => return Err(anyhow!(words)),
                None => self.panel.frame_error = Some(words),
            },
            Ok(frame) => {
                (self.before, self.panel.frame_error) = (None, None);
                if let Some(job) = self.asked.as_ref().filter(|job| job.revision == answer.revision) {
                    self.script.answered(self.asked_at.elapsed());
                    self.script.unfinished += u32::from(!job.moving && !frame.refined.whole);
                }
                (self.truth, self.compared, self.mixed) = (None, None, None);
                self.panel.history.add(&frame);
                self.frame = Some((answer.revision, frame));
                self.set_title();
            }
        }
        Ok(())
    }

    /// Shows what came of GLSL that was saved.
    #[cfg(feature = "hot-reload")]
    pub(super) fn take_reload(&mut self) {
        let Some(said) = self.reloading.as_ref().and_then(reload::Reloading::take) else { return };
        self.script.reloaded();
        match said {
            Ok(count) => {
                say!("shaders compiled anew: {count}");
                self.panel.shader_error = None;
                if let Some(worker) = self.worker.as_ref().filter(|_| count > 0) {
                    worker.renew();
                    self.moves();
                }
            }
            Err(words) => {
                out::warn(&words);
                self.panel.shader_error = Some(words);
            }
        }
    }

    pub(super) fn set_title(&self) {
        let (Some(shown), Some((_, frame))) = (&self.shown, &self.frame) else { return };
        let (width, height) = shown.screen.size();
        let coarse = match frame.divisor {
            1 => String::new(),
            by => format!(" at 1/{by}"),
        };
        let (name, ms) = (&self.subject.scene.name, frame.ms);
        let refined = frame.refined.words(frame.report.noise);
        let title = format!("{name} · {width}x{height}{coarse} · {ms:.0} ms{refined} · {}", self.context.name);
        shown.window.set_title(&title);
    }
}
