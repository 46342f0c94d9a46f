//! Plays a user in tests: one act per line, each after the previous one is shown.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;
use twobounce::output::read;
use twobounce::settings::keys;
use twobounce::{Error, Result};
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;

use super::App;
use super::beside::{Mix, Other};
use super::layer::Layer;
use super::question::Question;
use super::screen::Call;
use crate::say;

/// The longest time that an act may wait, so that a script fails instead of waiting forever.
const LONGEST_WAIT: Duration = Duration::from_secs(300);
/// The interval of requests to a window manager.
const AGAIN: Duration = Duration::from_secs(1);

/// The condition for the next act.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Wait {
    #[default]
    Nothing,
    /// The picture is complete and at rest.
    Rest,
    /// The picture is fully refined.
    Refined,
    /// The last requested picture is shown.
    Answer,
    /// A question is answered.
    Found,
    /// The path tracer has finished its first round.
    Truth,
    /// GLSL was saved once more than before.
    Reload,
    /// The animation has played this many seconds.
    Played(f64),
    /// The window manager has minimised or restored the window; one that starts meanwhile is asked again.
    Minimised(bool),
}

#[derive(Default)]
pub struct Script {
    path: PathBuf,
    /// Remaining acts with the numbers of their lines.
    acts: VecDeque<(usize, String)>,
    wait: Wait,
    /// The time since which the next act waits.
    since: Option<Instant>,
    /// The time of the last request to the window manager.
    managed: Option<Instant>,
    /// The number of saved GLSL changes that were not waited for yet.
    reloads: u32,
    /// Response times of movements.
    answers: Vec<Duration>,
    /// The number of incomplete pictures at rest.
    pub unfinished: u32,
}

impl Script {
    /// # Errors
    /// Reads the file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read::text(path, "script")?;
        let lines = (1..).zip(text.lines().map(|line| line.trim().to_owned()));
        Ok(Self {
            path: path.to_owned(),
            acts: lines.filter(|(_, line)| !line.is_empty()).collect(),
            ..Self::default()
        })
    }

    pub fn is_done(&self) -> bool {
        self.acts.is_empty()
    }

    /// Reports that a question was answered.
    pub fn found(&mut self) {
        if self.wait == Wait::Found {
            self.wait = Wait::Nothing;
        }
    }

    /// Reports that GLSL was saved.
    #[cfg(feature = "hot-reload")]
    pub fn reloaded(&mut self) {
        self.reloads += 1;
    }

    /// Reports that the last request is shown, after this time.
    pub fn answered(&mut self, after: Duration) {
        if self.wait == Wait::Answer {
            self.wait = Wait::Nothing;
            self.answers.push(after);
        }
    }

    /// Median and maximum of response times to movements.
    fn answers(&self) -> String {
        let mut ms: Vec<f64> = self.answers.iter().map(|d| 1e3 * d.as_secs_f64()).collect();
        ms.sort_by(f64::total_cmp);
        match ms.last() {
            Some(worst) => format!("{} answers, median {:.0} ms, worst {worst:.0} ms", ms.len(), ms[ms.len() / 2]),
            None => "no answers".into(),
        }
    }
}

impl App {
    /// Plays one line of the script, unless something is in progress.
    pub(super) fn act(&mut self, event_loop: &ActiveEventLoop) -> anyhow::Result<()> {
        let Some(frame) = &self.frame else { return Ok(()) };
        let refined = frame.passes >= self.panel.choice.refine;
        if self.waits(refined) {
            let since = *self.script.since.get_or_insert_with(Instant::now);
            anyhow::ensure!(
                since.elapsed() < LONGEST_WAIT,
                "the script waited {} s for {:?}",
                LONGEST_WAIT.as_secs(),
                self.script.wait
            );
            return Ok(());
        }
        (self.script.wait, self.script.since) = (Wait::Nothing, None);
        let Some((at, line)) = self.script.acts.pop_front() else { return Ok(()) };
        let path = self.script.path.clone();
        let senseless = || Error::file(&path, format!("line {at}: {line:?} is no step of a script; correct it"));
        self.script.wait = self.act_out(event_loop, &line, &senseless)?;
        self.redraw();
        Ok(())
    }

    /// Whether the next act still waits. `refined` says that a picture at rest cannot improve.
    fn waits(&mut self, refined: bool) -> bool {
        let rests = self.rests();
        match self.script.wait {
            Wait::Nothing => false,
            Wait::Rest => !rests,
            Wait::Refined => !rests || !refined,
            Wait::Answer | Wait::Found => true,
            Wait::Truth => self.compared.is_none(),
            Wait::Reload => {
                let saved = self.script.reloads > 0;
                self.script.reloads -= u32::from(saved);
                !saved
            }
            Wait::Played(seconds) => self.later_s < seconds,
            Wait::Minimised(whether) => {
                let Some(shown) = &self.shown else { return true };
                let waits = shown.window.is_minimized().unwrap_or(false) != whether;
                if waits && self.script.managed.is_none_or(|at| at.elapsed() > AGAIN) {
                    shown.window.set_minimized(whether);
                    self.script.managed = Some(Instant::now());
                }
                waits
            }
        }
    }

    /// Plays a line. Returns the condition for the next one.
    fn act_out(
        &mut self,
        event_loop: &ActiveEventLoop,
        line: &str,
        senseless: &dyn Fn() -> Error,
    ) -> anyhow::Result<Wait> {
        let (act, rest) = line.split_once(' ').unwrap_or((line, ""));
        let mut words = rest.split_whitespace();
        let mut number = || words.next().and_then(|word| word.parse::<f64>().ok()).ok_or_else(senseless);
        let Some(shown) = &mut self.shown else { return Ok(Wait::Nothing) };
        match act {
            "rest" => return Ok(Wait::Rest),
            "refined" => return Ok(Wait::Refined),
            // The minimum number of seconds that the animation has played.
            "wait" => return Ok(Wait::Played(number()?)),
            "reload" => return Ok(Wait::Reload),
            "minimised" => return Ok(Wait::Minimised(true)),
            "restored" => return Ok(Wait::Minimised(false)),
            // Radians to the left and up.
            "turn" => {
                let (left, up) = (number()?, number()?);
                self.eye().turn(left, up);
                self.moves();
                return Ok(Wait::Answer);
            }
            // Metres to the right, up, and forward.
            "walk" => {
                let by = DVec3::new(number()?, number()?, number()?);
                self.eye().walk(by);
                self.moves();
                return Ok(Wait::Answer);
            }
            "key" => {
                let known = [KeyCode::KeyC, KeyCode::KeyF, KeyCode::KeyP, KeyCode::KeyR, KeyCode::Space, KeyCode::Tab];
                let named = |key: &&KeyCode| format!("{key:?}").trim_start_matches("Key") == rest;
                let key = *known.iter().find(named).ok_or_else(senseless)?;
                self.key(event_loop, key, true);
                self.key(event_loop, key, false);
            }
            "set" => self.panel.choice.settings.set(rest)?,
            "layer" => self.panel.choice.layer = Layer::named(rest).ok_or_else(senseless)?,
            // The mix, and the second picture.
            "beside" => {
                let (mix, other) = rest.split_once(' ').ok_or_else(senseless)?;
                self.panel.mixing.mix = Mix::ALL.iter().find(|(_, name)| *name == mix).ok_or_else(senseless)?.0;
                self.panel.choice.beside = Other::all().find(|choice| choice.name() == other).ok_or_else(senseless)?;
            }
            // The right button on a pixel, and the button next to a setting.
            "rays" => {
                self.pointer = Some((number()?, number()?));
                self.ask_rays();
                return Ok(Wait::Found);
            }
            "cost" => {
                let key = keys().iter().find(|key| key.name == rest).ok_or_else(senseless)?.name;
                self.panel.question = Some(Question::Cost(key));
                return Ok(Wait::Found);
            }
            "bounds" => self.panel.bounds = !self.panel.bounds,
            "drop" => self.dropped(Path::new(rest)),
            "size" => {
                let size = PhysicalSize::new(number()? as u32, number()? as u32);
                let _ = shown.window.request_inner_size(size);
            }
            // The next frames find the swapchain outdated, or the device lost.
            "fault" => match rest {
                "acquire" => shown.screen.faults.push_back(Call::Acquire),
                "present" => shown.screen.faults.push_back(Call::Present),
                "lost" => shown.screen.context().lose(),
                _ => return Err(senseless().into()),
            },
            // The device of the frames is lost.
            "lose" => {
                self.context.lose();
                self.moves();
            }
            "minimise" => shown.window.set_minimized(true),
            "restore" => shown.window.set_minimized(false),
            "remake" => {
                for _ in 0..number()? as u32 {
                    let Some(shown) = &mut self.shown else { break };
                    shown.screen.remake(&shown.window)?;
                    self.draw(None)?;
                }
            }
            "save" => self.save(Path::new(rest))?,
            "grab" => self.draw(Some(Path::new(rest)))?,
            // The path tracer runs, and the picture is blended with it by this amount.
            "truth" => {
                (self.panel.truth, self.panel.fade) = (true, number()? as f32);
                return Ok(Wait::Truth);
            }
            "panel" => self.panel.open = rest == "open",
            // Prints swapchains, response times, and costs.
            "say" => {
                let made = shown.screen.made;
                let error =
                    self.compared.as_ref().map_or(String::new(), |compared| format!("; {}", compared.in_words()));
                let (unfinished, answers) = (self.script.unfinished, self.script.answers());
                for ray in &self.panel.rays {
                    say!("ray {} {} {:?} {}", ray.from, ray.to, ray.light, ray.met);
                }
                say!("costs {}", self.panel.costs_in_words());
                say!("swapchains {made}; unfinished pictures {unfinished}; {answers}{error}");
            }
            "quit" => event_loop.exit(),
            _ => return Err(senseless().into()),
        }
        Ok(Wait::Nothing)
    }
}
