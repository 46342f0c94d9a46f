//! A user for tests: one act a line, each once what was asked before is shown.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use ash::vk;
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

/// What an act may wait for at most; a script that would wait for ever fails.
const LONGEST_WAIT: Duration = Duration::from_secs(300);
/// Between two requests to a window manager.
const AGAIN: Duration = Duration::from_secs(1);

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// Waits until the picture is whole and at rest,
    Rest,
    /// and as good as it gets.
    Refined,
    /// Seconds that the animation has played at least.
    Wait(f64),
    /// Radians to the left and up.
    Turn(f64, f64),
    /// Metres to the right, up, and ahead.
    Walk(DVec3),
    Key(KeyCode),
    /// `key=value`
    Set(String),
    Layer(Layer),
    /// What is shown beside, and how.
    Beside(Other, Mix),
    /// A file, dragged onto the window.
    Drop(PathBuf),
    /// Waits until GLSL was saved once more than before.
    Reload,
    Size(u32, u32),
    /// What the window's next frames come to.
    Fault(Call, vk::Result),
    /// The device that makes frames is lost.
    Lose,
    Minimise(bool),
    /// The same, until the window manager did it: one that starts meanwhile hears of it too.
    Minimised(bool),
    /// Swapchains, made anew so many times.
    Remake(u32),
    Save(PathBuf),
    /// What the swapchain holds.
    Grab(PathBuf),
    Panel(bool),
    /// The right button on a pixel, or the button beside a setting; waits for what comes of it.
    RaysOf(f64, f64),
    CostOf(&'static str),
    Bounds,
    /// Runs the path tracer beside, and waits for its first round; shown so far faded to it.
    Truth(f32),
    /// Prints swapchains, and how long answers took.
    Say,
    Quit,
}

/// What an act may wait for.
pub struct Now {
    pub rests: bool,
    pub refined: bool,
    pub compared: bool,
    /// Seconds that the animation has played.
    pub played_s: f64,
    pub minimised: bool,
}

#[derive(Default)]
pub struct Script {
    acts: VecDeque<Act>,
    /// The last act, and when it began.
    last: Option<(Act, Instant)>,
    /// When the window manager was asked last.
    managed: Option<Instant>,
    /// What the last act waits for.
    for_rest: bool,
    for_refined: bool,
    for_answer: bool,
    for_truth: bool,
    for_time_s: f64,
    for_reload: bool,
    for_found: bool,
    /// GLSL that was saved and not waited for yet.
    reloads: u32,
    /// Of movements.
    answers: Vec<Duration>,
    /// Pictures at rest that were not whole yet.
    pub unfinished: u32,
}

impl Script {
    /// # Errors
    /// The file, and the line that makes no sense.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read::text(path, "script")?;
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let acts = lines.map(|(at, line)| {
            act(line).ok_or_else(|| Error::file(path, format!("line {}: {line:?} is nothing that a user does", at + 1)))
        });
        Ok(Self { acts: acts.collect::<Result<_>>()?, ..Self::default() })
    }

    pub fn is_done(&self) -> bool {
        self.acts.is_empty()
    }

    /// The next act, where the last one waits for nothing more.
    pub fn next(&mut self) -> Option<Act> {
        let act = self.acts.pop_front()?;
        self.for_rest = act == Act::Rest;
        self.for_refined = act == Act::Refined;
        self.for_time_s = if let Act::Wait(seconds) = act { seconds } else { 0.0 };
        self.for_truth = matches!(act, Act::Truth(_));
        self.for_reload = act == Act::Reload;
        self.for_found = matches!(act, Act::RaysOf(..) | Act::CostOf(_));
        self.for_answer = matches!(act, Act::Turn(..) | Act::Walk(_));
        self.last = Some((act.clone(), Instant::now()));
        Some(act)
    }

    /// What the window manager is to do for the last act.
    fn for_minimised(&self) -> Option<bool> {
        if let Some((Act::Minimised(whether), _)) = self.last { Some(whether) } else { None }
    }

    /// What the window manager is to be asked now, once more.
    fn asks_manager(&mut self) -> Option<bool> {
        let whether = self.for_minimised()?;
        let due = self.managed.is_none_or(|at| at.elapsed() > AGAIN);
        due.then(|| self.managed = Some(Instant::now())).map(|()| whether)
    }

    /// Whether the last act waits for something yet.
    pub fn waits(&mut self, now: &Now) -> bool {
        if self.for_reload && self.reloads > 0 {
            (self.for_reload, self.reloads) = (false, self.reloads - 1);
        }
        self.for_reload
            || now.played_s < self.for_time_s
            || self.for_answer
            || self.for_found
            || self.for_minimised().is_some_and(|whether| whether != now.minimised)
            || self.for_rest && !now.rests
            || self.for_refined && !now.refined
            || self.for_truth && !now.compared
    }

    /// # Errors
    /// The last act waits for longer than anything takes.
    fn patience(&self) -> anyhow::Result<()> {
        match &self.last {
            Some((act, at)) if at.elapsed() > LONGEST_WAIT => {
                anyhow::bail!("the script waited {} s for {act:?}", LONGEST_WAIT.as_secs())
            }
            _ => Ok(()),
        }
    }

    /// A question was answered.
    pub fn found(&mut self) {
        self.for_found = false;
    }

    /// GLSL was saved.
    #[cfg(feature = "hot-reload")]
    pub fn reloaded(&mut self) {
        self.reloads += 1;
    }

    /// What was asked for last is shown, so long after.
    pub fn answered(&mut self, after: Duration) {
        if std::mem::take(&mut self.for_answer) {
            self.answers.push(after);
        }
    }

    /// Median and worst of the answers to movements.
    pub fn answers(&self) -> String {
        let mut ms: Vec<f64> = self.answers.iter().map(|d| 1e3 * d.as_secs_f64()).collect();
        ms.sort_by(f64::total_cmp);
        match ms.last() {
            Some(worst) => format!("{} answers, median {:.0} ms, worst {worst:.0} ms", ms.len(), ms[ms.len() / 2]),
            None => "no answers".into(),
        }
    }
}

fn act(line: &str) -> Option<Act> {
    let (name, rest) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
    let mut numbers = rest.split_whitespace().map(|word| word.parse::<f64>().ok());
    let mut number = || numbers.next().flatten();
    Some(match name {
        "rest" => Act::Rest,
        "refined" => Act::Refined,
        "wait" => Act::Wait(number()?),
        "turn" => Act::Turn(number()?, number()?),
        "walk" => Act::Walk(DVec3::new(number()?, number()?, number()?)),
        "key" => Act::Key(match rest {
            "C" => KeyCode::KeyC,
            "F" => KeyCode::KeyF,
            "R" => KeyCode::KeyR,
            "Space" => KeyCode::Space,
            "Tab" => KeyCode::Tab,
            _ => return None,
        }),
        "set" => Act::Set(rest.to_owned()),
        "layer" => Act::Layer(Layer::named(rest)?),
        "beside" => {
            let (mix, other) = rest.split_once(' ')?;
            let mix = Mix::ALL.iter().find(|(_, name)| *name == mix)?.0;
            Act::Beside(Other::all().find(|choice| choice.name() == other)?, mix)
        }
        "rays" => Act::RaysOf(number()?, number()?),
        "cost" => Act::CostOf(keys().iter().find(|key| key.name == rest)?.name),
        "bounds" => Act::Bounds,
        "reload" => Act::Reload,
        "drop" => Act::Drop(rest.into()),
        "size" => Act::Size(number()? as u32, number()? as u32),
        "fault" => match rest {
            "acquire" => Act::Fault(Call::Acquire, vk::Result::ERROR_OUT_OF_DATE_KHR),
            "present" => Act::Fault(Call::Present, vk::Result::ERROR_OUT_OF_DATE_KHR),
            "lost" => Act::Fault(Call::Present, vk::Result::ERROR_DEVICE_LOST),
            _ => return None,
        },
        "lose" => Act::Lose,
        "minimise" => Act::Minimise(true),
        "minimised" => Act::Minimised(true),
        "restored" => Act::Minimised(false),
        "restore" => Act::Minimise(false),
        "remake" => Act::Remake(number()? as u32),
        "save" => Act::Save(rest.into()),
        "grab" => Act::Grab(rest.into()),
        "truth" => Act::Truth(number()? as f32),
        "panel" => Act::Panel(rest == "open"),
        "say" => Act::Say,
        "quit" => Act::Quit,
        _ => return None,
    })
}

impl App {
    /// One line of the script, once nothing is under way.
    pub(super) fn act(&mut self, event_loop: &ActiveEventLoop) -> anyhow::Result<()> {
        let Some((_, frame)) = &self.frame else { return Ok(()) };
        let minimised = self.shown.as_ref().is_some_and(|shown| shown.window.is_minimized() == Some(true));
        let rests = self.rests();
        let refined = rests && frame.refined.passes >= self.panel.refine;
        let now = Now { rests, refined, compared: self.compared.is_some(), played_s: self.later_s, minimised };
        if self.script.waits(&now) {
            if let (Some(whether), Some(shown)) = (self.script.asks_manager(), &self.shown) {
                shown.window.set_minimized(whether);
            }
            return self.script.patience();
        }
        let Some(act) = self.script.next() else { return Ok(()) };
        let Some(shown) = &mut self.shown else { return Ok(()) };
        match act {
            Act::Rest | Act::Refined | Act::Wait(_) | Act::Reload | Act::Minimised(_) => {}
            Act::Turn(left, up) => {
                self.eye().turn(left, up);
                self.moves();
            }
            Act::Walk(by) => {
                self.eye().walk(by);
                self.moves();
            }
            Act::Key(key) => {
                self.key(event_loop, key, true);
                self.key(event_loop, key, false);
            }
            Act::Set(text) => {
                self.panel.set(&text)?;
                self.moves();
            }
            Act::Layer(layer) => {
                self.panel.layer = layer;
                self.moves();
            }
            Act::Beside(other, mix) => {
                (self.panel.beside, self.panel.mix) = (other, mix);
                self.moves();
            }
            Act::RaysOf(x, y) => {
                self.pointer = Some((x, y));
                self.ask_rays();
            }
            Act::CostOf(key) => self.panel.question = Some(Question::Cost(key, Box::new(self.panel.settings.clone()))),
            Act::Bounds => self.panel.bounds = !self.panel.bounds,
            Act::Drop(path) => self.dropped(&path),
            Act::Size(width, height) => drop(shown.window.request_inner_size(PhysicalSize::new(width, height))),
            Act::Fault(call, result) => shown.screen.faults.push_back((call, result)),
            Act::Lose => {
                self.context.lose();
                self.moves();
            }
            Act::Minimise(whether) => shown.window.set_minimized(whether),
            Act::Remake(times) => {
                for _ in 0..times {
                    let Some(shown) = &mut self.shown else { break };
                    shown.screen.remake(&shown.window)?;
                    self.draw(None)?;
                }
            }
            Act::Save(path) => self.save(&path)?,
            Act::Grab(path) => self.draw(Some(&path))?,
            Act::Truth(fade) => (self.panel.truth, self.panel.fade) = (true, fade),
            Act::Panel(open) => self.panel.open = open,
            Act::Say => {
                let made = self.shown.as_ref().map_or(0, |shown| shown.screen.made);
                let error = self.compared.as_ref().map_or(String::new(), |compared| format!("; {}", compared.words()));
                let (unfinished, answers) = (self.script.unfinished, self.script.answers());
                let costs = self.panel.costs_in_words();
                for ray in &self.panel.rays {
                    say!("ray {} {} {:?} {}", ray.from, ray.to, ray.light, ray.met);
                }
                say!("costs {costs}");
                say!("swapchains {made}; unfinished pictures {unfinished}; {answers}{error}");
            }
            Act::Quit => event_loop.exit(),
        }
        self.redraw();
        Ok(())
    }
}
