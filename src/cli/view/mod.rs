//! `twobounce view`: a scene in a window. [`worker`] makes frames of each [`job`] on a thread with [`maker`], and
//! [`answers`] receives them. [`mod@picture`] composes the picture for the [`screen`]. [`panel`] has the settings and
//! [`times`], and [`overlay`] draws lines over the picture. [`subject`] is the open scene, and [`eye`] the view that
//! keys and mouse move ([`events`]). [`layer`] selects the shown data, [`beside`] a second picture, [`truth`] the path
//! tracer, and [`question`] further queries to the thread. [`script`] plays a user in tests.

mod answers;
mod beside;
mod command;
mod events;
mod eye;
mod job;
mod layer;
mod maker;
mod overlay;
mod panel;
mod picture;
mod question;
#[cfg(feature = "hot-reload")]
mod reload;
mod screen;
mod script;
mod subject;
mod times;
mod truth;
mod worker;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::anyhow;
use clap::Args;
use glam::DVec3;
use twobounce::measure::refuse_invalid;
use twobounce::settings::{Center, Settings};
use twobounce::vk::Context;
use winit::dpi::PhysicalSize;
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};
use winit::keyboard::KeyCode;
use winit::window::Window;

use super::args::{RunArgs, SceneArgs, SettingsArgs};
use super::display::DisplayArgs;
use super::interrupt;
use super::scene::fitted;
use answers::Losses;
use eye::Eye;
use job::{Job, News, PanelChoice, ShownFrame};
use maker::Makers;
use panel::Panel;
use picture::Mixed;
use screen::Screen;
use script::Script;
use subject::Subject;
use truth::{Compared, Truth};
use worker::Worker;

#[derive(Args, Debug)]
pub struct ViewArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub settings: SettingsArgs,
    #[command(flatten)]
    pub display: DisplayArgs,
    /// Start the animation at once
    #[arg(long)]
    pub play: bool,
    /// At rest, refine the picture to the mean of this many passes over the image; C then prints the number
    #[arg(long, value_name = "PASSES", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub refine: u32,
    /// The folder of GLSL to watch; saved files are compiled and shown [default: that of the program's source]
    #[cfg(feature = "hot-reload")]
    #[arg(long, value_name = "DIR")]
    pub glsl: Option<PathBuf>,
    /// Play the acts of this file, line by line; for tests
    #[arg(long, value_name = "FILE", hide = true)]
    pub script: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// The time without movement after which the camera counts as at rest.
const REST: Duration = Duration::from_millis(250);
/// The longest time of a movement step, so that a suspended window does not jump.
const LONGEST_STEP: Duration = Duration::from_millis(100);
/// The longest time that an animation advances from one frame to the next.
const LONGEST_LEAP: Duration = Duration::from_secs(1);
/// The initial speed of a held key in scene diagonals per second.
const SPEED: f64 = 0.15;
/// Keys that move the eye: to the right, up, and forward.
const WAYS: [(KeyCode, DVec3); 6] = [
    (KeyCode::KeyD, DVec3::X),
    (KeyCode::KeyA, DVec3::NEG_X),
    (KeyCode::KeyE, DVec3::Y),
    (KeyCode::KeyQ, DVec3::NEG_Y),
    (KeyCode::KeyW, DVec3::Z),
    (KeyCode::KeyS, DVec3::NEG_Z),
];

pub const KEYS: &str = "W A S D, Q E  move\nleft button  look about\nright button  rays of a pixel\nmiddle, or Alt and left  orbit\nwheel  speed\nF  frame the scene\n\
Space  play or pause\nR  read the scene's file again; a file dropped here is shown instead\nC  print the command of this picture\nP  save it as PNG and EXR\nTab  panel\nEsc  close";

/// Opens the window until it is closed. `typed` holds the scene and flags, which `render` understands too; `instead`
/// names an alternative without a window.
pub fn run(args: &ViewArgs, typed: Vec<String>, instead: &str) -> anyhow::Result<ExitCode> {
    show(args, typed).map_err(|error| match error.downcast::<NoWindow>() {
        Ok(NoWindow(why)) => anyhow!("no window can be opened ({why}): use {instead}"),
        Err(error) => error,
    })
}

/// The reason why there can be no window.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct NoWindow(String);

impl NoWindow {
    fn because(why: impl std::fmt::Display) -> anyhow::Error {
        let text = why.to_string();
        // The window library begins with a path and line of the machine that built it.
        let said = text.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
        Self(said.map_or(text.as_str(), |(_, why)| why.trim_end_matches('.')).to_owned()).into()
    }
}

fn show(args: &ViewArgs, typed: Vec<String>) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    args.scene.check()?;
    let script = args.script.as_deref().map(Script::read).transpose()?.unwrap_or_default();
    interrupt::install()?;
    let event_loop = EventLoop::with_user_event().build().map_err(NoWindow::because)?;
    let (opened, context) = args.scene.open_on(&args.run)?;
    let settings = fitted(&opened, settings);
    #[cfg(feature = "hot-reload")]
    reload::begin(args.glsl.as_deref(), event_loop.create_proxy())?;
    let (tone, exposure) = (args.display.tone(), args.display.exposure_ev());
    let choice = PanelChoice { settings, tone, exposure, refine: args.refine, ..PanelChoice::default() };
    let now = Instant::now();
    let mut app = App {
        run: args.run.clone(),
        context,
        subject: Subject::new(args.scene.clone(), typed, opened, &args.run),
        before: None,
        opened: now,
        proxy: event_loop.create_proxy(),
        worker: None,
        first: 1,
        shaders: 0,
        shown: None,
        panel: Panel::new(&args.settings.preset, choice),
        script,
        eye: None,
        speed: SPEED,
        held: HashSet::new(),
        pointer: None,
        buttons: (false, false),
        later_s: 0.0,
        plays: args.play,
        stepped: now,
        played: now,
        moved: None,
        asked: None,
        drawn: now,
        asked_at: now,
        answered: 0,
        whole: false,
        saves: false,
        frame: None,
        truth: None,
        compared: None,
        mixed: None,
        lost: Losses::default(),
        failed: None,
    };
    event_loop.run_app(&mut app).map_err(NoWindow::because)?;
    drop(app.worker.take());
    let closed = app.shown.take().map_or(Ok(()), |shown| shown.screen.close());
    if let Some(error) = app.failed {
        return Err(error);
    }
    interrupt::check()?;
    closed?;
    refuse_invalid(&app.context)?;
    Ok(ExitCode::SUCCESS)
}

/// The window and its resources; fields are dropped in this order.
struct OpenWindow {
    egui: egui_winit::State,
    screen: Screen,
    window: Window,
}

struct App {
    run: RunArgs,
    context: Arc<Context>,
    subject: Subject,
    /// The previous scene with its settings, eye and time, until the first frame of the new one.
    before: Option<(Subject, Settings, Option<Eye>, f64)>,
    opened: Instant,
    proxy: EventLoopProxy<News>,
    worker: Option<Worker>,
    /// The first job of this worker; results of earlier jobs belong to another one.
    first: u64,
    /// How often shaders were recompiled.
    shaders: u32,
    shown: Option<OpenWindow>,
    panel: Panel,
    script: Script,
    /// The eye; `None` for the requested camera.
    eye: Option<Eye>,
    speed: f64,
    held: HashSet<KeyCode>,
    pointer: Option<(f64, f64)>,
    buttons: (bool, bool),
    later_s: f64,
    plays: bool,
    stepped: Instant,
    /// The time at which the animation last advanced.
    played: Instant,
    moved: Option<Instant>,
    asked: Option<Job>,
    /// The time at which the window was last drawn.
    drawn: Instant,
    /// The time of the newest job.
    asked_at: Instant,
    /// The job that was last answered by a frame or an error.
    answered: u64,
    /// Whether the frame is complete.
    whole: bool,
    /// Whether the picture is saved once it is complete.
    saves: bool,
    frame: Option<ShownFrame>,
    truth: Option<Truth>,
    compared: Option<Compared>,
    /// The mix of the picture on the screen; `None` if the picture is older than the frame.
    mixed: Option<Mixed>,
    lost: Losses,
    failed: Option<anyhow::Error>,
}

impl App {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> anyhow::Result<()> {
        let (width, height) = self.subject.args.size;
        let attributes = Window::default_attributes()
            .with_title(&self.subject.scene.name)
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(NoWindow::because)?;
        self.show_in(window)?;
        self.start()
    }

    /// Opens the window's own device and its resources.
    fn show_in(&mut self, window: Window) -> anyhow::Result<()> {
        let screen = Screen::new(&window, &self.context.name, self.run.device.validation)?;
        let context = egui::Context::default();
        let side = Some(4096);
        let egui = egui_winit::State::new(context, egui::ViewportId::ROOT, &window, None, None, side);
        self.shown = Some(OpenWindow { egui, screen, window });
        self.mixed = None;
        Ok(())
    }

    /// Starts to make frames of the open scene.
    fn start(&mut self) -> anyhow::Result<()> {
        self.worker = None; // waits for its frame
        self.first = self.next_revision();
        let Subject { scene, options, .. } = &self.subject;
        let makers = Makers::new(self.context.clone(), scene.clone(), options.clone(), self.proxy.clone());
        self.worker = Some(Worker::start(makers)?);
        self.moves(); // a coarse picture comes first
        Ok(())
    }

    /// Opens a dropped scene, as `twobounce view` shows it without flags.
    fn dropped(&mut self, path: &Path) {
        self.reopen(SceneArgs::plain(path, self.subject.args.size), vec![]);
    }

    /// Opens another scene. If that fails, shows the error and keeps the current one.
    fn reopen(&mut self, args: SceneArgs, typed: Vec<String>) {
        let opened = match args.open_for(&self.context, &self.run) {
            Ok(opened) => opened,
            Err(error) => return self.panel.error = Some(error.to_string()),
        };
        self.panel.error = None;
        self.panel.rays.clear();
        // Voxels that were fitted to another scene are not suitable for this one.
        let mut settings = self.panel.choice.settings.clone();
        if settings.grid.center == Center::Camera {
            (settings.grid.center, settings.grid.side) = (Center::Scene, None);
        }
        let settings = std::mem::replace(&mut self.panel.choice.settings, fitted(&opened, settings));
        let again = args.path == self.subject.args.path;
        let before = std::mem::replace(&mut self.subject, Subject::new(args, typed, opened, &self.run));
        self.before.get_or_insert((before, settings, self.eye, self.later_s));
        if !again {
            (self.eye, self.later_s) = (None, 0.0);
        }
        if let Err(error) = self.start() {
            self.panel.error = Some(error.to_string());
        }
    }

    /// The movable eye: the camera is no longer the requested one.
    fn eye(&mut self) -> &mut Eye {
        let Subject { scene, shot, diagonal_m, .. } = &self.subject;
        self.eye.get_or_insert_with(|| Eye::of_view(&shot.at(scene, self.later_s).1, 0.5 * diagonal_m))
    }

    /// Requests a frame of the current view.
    fn ask(&mut self, moving: bool) {
        let (Some(worker), Some(shown)) = (&self.worker, &self.shown) else { return };
        let size = shown.screen.size();
        if size.0 == 0 || size.1 == 0 {
            return; // the window is minimised
        }
        let Subject { scene, shot, .. } = &self.subject;
        // If only the eye moves, the pose stays.
        let same = self.asked.as_ref().filter(|job| job.revision >= self.first && job.later_s == self.later_s);
        let pose = same.map_or_else(|| Arc::new(shot.pose(scene, self.later_s)), |job| job.pose.clone());
        let job = Job {
            revision: self.next_revision(),
            shaders: self.shaders,
            later_s: self.later_s,
            view: self.eye.map_or_else(|| shot.view(scene, &pose), |eye| eye.view()),
            pose,
            size,
            moving,
            choice: self.panel.choice.clone(),
        };
        worker.shared.change(|state| state.job = Some(job.clone()));
        (self.asked, self.asked_at) = (Some(job), Instant::now());
    }

    fn next_revision(&self) -> u64 {
        self.asked.as_ref().map_or(1, |job| job.revision + 1)
    }

    fn moves(&mut self) {
        self.moved = Some(Instant::now());
        self.ask(true);
    }

    /// Advances the eye by the held keys, and the animation, by the time since the last step.
    fn step(&mut self) {
        let since = self.stepped.elapsed().min(LONGEST_STEP).as_secs_f64();
        self.stepped = Instant::now();
        let by: DVec3 = WAYS.iter().filter(|(key, _)| self.held.contains(key)).map(|(_, way)| way).sum();
        let walks = by != DVec3::ZERO;
        if walks {
            let metres = self.speed * self.subject.diagonal_m * since;
            self.eye().walk(by * metres);
        }
        // An animation waits until its frames are shown.
        let shows = self.asked.as_ref().is_none_or(|job| job.revision == self.answered);
        if self.plays && shows {
            self.later_s += self.played.elapsed().min(LONGEST_LEAP).as_secs_f64();
            self.played = Instant::now();
        }
        if walks || self.plays && shows {
            self.moves();
        } else if self.moved.is_some_and(|at| at.elapsed() > REST) {
            self.moved = None;
            self.ask(false);
        }
    }

    /// Whether the newest job has its complete frame.
    fn rests(&self) -> bool {
        let is_last = |job: &Job| !job.moving && job.revision == self.answered && job.choice == self.panel.choice;
        self.asked.as_ref().is_some_and(is_last) && self.whole && self.moved.is_none()
    }

    fn redraw(&self) {
        if let Some(shown) = &self.shown {
            shown.window.request_redraw();
        }
    }

    fn or_fail(&mut self, event_loop: &ActiveEventLoop, result: anyhow::Result<()>) {
        if let Err(error) = result.or_else(|error| self.recover(error)) {
            self.failed.get_or_insert(error);
            event_loop.exit();
        }
    }
}
