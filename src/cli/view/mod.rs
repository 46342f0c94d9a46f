//! `twobounce view`: a scene in a window. [`worker`] makes frames on a thread, as [`maker`] says, [`screen`] shows them, [`panel`] has the settings.
//! [`subject`] is what is open, [`eye`] what keys and mouse move, [`events`] what they do; [`layer`] is what of a frame is shown,
//! [`beside`] other settings next to it, [`truth`] the path tracer beside. [`script`] plays a user for tests.

mod beside;
mod command;
mod events;
mod eye;
mod layer;
mod lost;
mod maker;
mod overlay;
mod panel;
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

use anyhow::{Context as _, anyhow};
use clap::Args;
use glam::DVec3;
use twobounce::layers::Aov;
use twobounce::output::file;
use twobounce::settings::Settings;
use twobounce::vk::Context;
use winit::dpi::PhysicalSize;
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};
use winit::keyboard::KeyCode;
use winit::window::Window;

use super::args::{RunArgs, SceneArgs, SettingsArgs, number};
use super::{interrupt, out};
use crate::say;
use beside::Mix;
use command::Seen;
use eye::Eye;
use layer::Layer;
use lost::Losses;
use overlay::Lines;
use panel::Panel;
use screen::{Overlay, Screen};
use script::Script;
use subject::Subject;
use truth::{Compared, Truth};
use worker::{Frame, Job, Worker};

#[derive(Args, Debug)]
pub struct ViewArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Exposure in stops: radiance is multiplied by 2^EV [default: automatic]
    #[arg(long, value_name = "EV", allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n.abs() <= 60.0, "write stops between -60 and 60"))]
    pub exposure: Option<f64>,
    /// Play the animation at once
    #[arg(long)]
    pub play: bool,
    /// At rest, refine the picture to the mean of so many passes over the image; C then prints as many
    #[arg(long, value_name = "PASSES", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub refine: u32,
    /// Watch this folder of GLSL, and show what is saved there [default: that of the program's source]
    #[cfg(feature = "hot-reload")]
    #[arg(long, value_name = "DIR")]
    pub glsl: Option<PathBuf>,
    /// Do what this file says, line by line, as a user would; for tests
    #[arg(long, value_name = "FILE", hide = true)]
    pub script: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// The camera counts as at rest this long after it moved.
const REST: Duration = Duration::from_millis(250);
/// The longest time that a step of movement makes up for: a window that was suspended does not leap.
const LONGEST_STEP: Duration = Duration::from_millis(100);
/// The longest time that an animation goes on from one frame to the next.
const LONGEST_LEAP: Duration = Duration::from_secs(1);
/// The scene's diagonals that a held key goes in a second, at first.
const SPEED: f64 = 0.15;
/// Seconds that each of two pictures is shown by turns.
const FLICKER_S: f64 = 0.5;

pub const KEYS: &str = "W A S D, Q E  move\nleft button  look about\nright button  rays of a pixel\nmiddle, or Alt and left  orbit\nwheel  speed\nF  frame the scene\n\
Space  play or pause\nR  read the scene's file again; a file dropped here is shown instead\nC  print the command of this picture\nP  save it as PNG and EXR\nTab  panel\nEsc  close";

/// Opens the window, and stays until it is closed. `typed`: scene and flags, as `render` takes them too; `instead`: what to use
/// where there is no window.
pub fn run(args: &ViewArgs, typed: Vec<String>, instead: &str) -> anyhow::Result<ExitCode> {
    show(args, typed).map_err(|error| match error.downcast::<NoWindow>() {
        Ok(NoWindow(why)) => anyhow!("no window can be opened ({why}): use {instead}"),
        Err(error) => error,
    })
}

/// Why there can be no window.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct NoWindow(String);

impl NoWindow {
    fn because(why: impl std::fmt::Display) -> anyhow::Error {
        Self(why.to_string()).into()
    }
}

fn show(args: &ViewArgs, typed: Vec<String>) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    args.scene.check()?;
    let script = args.script.as_deref().map(Script::read).transpose()?.unwrap_or_default();
    interrupt::install()?;
    let event_loop = EventLoop::new().map_err(NoWindow::because)?;
    let (opened, context) = args.scene.open_on(&args.run)?;
    let subject = Subject::new((args.scene.clone(), typed), opened, &args.run);
    #[cfg(feature = "hot-reload")]
    let reloading = reload::Reloading::begin(args.glsl.as_deref(), event_loop.create_proxy())?;
    let mut app = App::new(args, (subject, context), settings, script, event_loop.create_proxy());
    #[cfg(feature = "hot-reload")]
    (app.reloading = reloading);
    event_loop.run_app(&mut app).map_err(NoWindow::because)?;
    drop(app.worker.take());
    drop(app.shown.take());
    if let Some(error) = app.failed {
        return Err(error);
    }
    interrupt::check()?;
    screen::refuse_invalid()?;
    twobounce::measure::refuse_invalid(&app.context)?;
    Ok(ExitCode::SUCCESS)
}

/// What the picture on the screen is, of a frame.
#[derive(Clone, Copy, PartialEq)]
enum Mixed {
    Plain,
    /// How far it is faded, and the reference's samples.
    Truth(f32, u32),
    /// How, where the line is, and whether it is the other's turn.
    Beside(Mix, f32, bool),
}

/// The window and what belongs to it; fields are dropped in this order.
struct Shown {
    egui: egui_winit::State,
    screen: Screen,
    window: Window,
}

struct App {
    run: RunArgs,
    context: Arc<Context>,
    subject: Subject,
    /// What was open before, until the first frame of what is.
    before: Option<(Subject, Option<Eye>, f64)>,
    opened: Instant,
    proxy: EventLoopProxy<()>,
    worker: Option<Worker>,
    shown: Option<Shown>,
    panel: Panel,
    script: Script,
    /// `None`: the camera that was asked for, at its place.
    eye: Option<Eye>,
    speed: f64,
    held: HashSet<KeyCode>,
    pointer: Option<(f64, f64)>,
    buttons: (bool, bool),
    later_s: f64,
    plays: bool,
    stepped: Instant,
    /// When the animation went on last.
    played: Instant,
    moved: Option<Instant>,
    asked: Option<Job>,
    /// When the window was drawn last.
    drawn: Instant,
    /// When the newest job was asked for.
    asked_at: Instant,
    /// Of the job that was answered last, with a frame or with words.
    answered: u64,
    /// With nothing better to come that was asked for.
    whole: bool,
    frame: Option<(u64, Frame)>,
    truth: Option<Truth>,
    compared: Option<Compared>,
    /// What is on the screen of the frame; `None` where that is older.
    mixed: Option<Mixed>,
    #[cfg(feature = "hot-reload")]
    reloading: Option<reload::Reloading>,
    lost: Losses,
    failed: Option<anyhow::Error>,
}

impl App {
    fn new(
        args: &ViewArgs,
        (subject, context): (Subject, Arc<Context>),
        settings: Settings,
        script: Script,
        proxy: EventLoopProxy<()>,
    ) -> Self {
        Self {
            run: args.run.clone(),
            context,
            subject,
            before: None,
            opened: Instant::now(),
            proxy,
            worker: None,
            shown: None,
            panel: Panel::new(&args.settings.preset, settings, (args.exposure.map(|ev| ev as f32), args.refine)),
            script,
            eye: None,
            speed: SPEED,
            held: HashSet::new(),
            pointer: None,
            buttons: (false, false),
            later_s: 0.0,
            plays: args.play,
            stepped: Instant::now(),
            played: Instant::now(),
            moved: None,
            asked: None,
            drawn: Instant::now(),
            asked_at: Instant::now(),
            answered: 0,
            whole: false,
            frame: None,
            truth: None,
            compared: None,
            mixed: None,
            #[cfg(feature = "hot-reload")]
            reloading: None,
            lost: Losses::default(),
            failed: None,
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> anyhow::Result<()> {
        let (width, height) = self.subject.args.size;
        let attributes = Window::default_attributes()
            .with_title(&self.subject.scene.name)
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(NoWindow::because)?;
        self.show_in(window)?;
        self.start();
        Ok(())
    }

    /// Opens the window's own device, and what is drawn by it.
    fn show_in(&mut self, window: Window) -> anyhow::Result<()> {
        let screen = Screen::new(&window, &self.context.name, self.run.device.validation)?;
        let context = egui::Context::default();
        let side = Some(4096);
        let egui = egui_winit::State::new(context, egui::ViewportId::ROOT, &window, None, None, side);
        self.shown = Some(Shown { egui, screen, window });
        self.mixed = None;
        Ok(())
    }

    /// Starts to make frames of what is open.
    fn start(&mut self) {
        self.worker = None; // waits for its frame
        self.worker = Some(Worker::start(self.subject.stage(&self.context), self.proxy.clone()));
        self.moves(); // a coarse picture comes first
    }

    /// Another scene, as `twobounce view` shows it without flags.
    fn dropped(&mut self, path: &Path) {
        let typed = vec![path.to_string_lossy().into_owned()];
        self.reopen(SceneArgs::plain(path, self.subject.args.size), typed);
    }

    /// Opens a scene instead of the one that is shown; where that fails, says why, and keeps what there is.
    fn reopen(&mut self, args: SceneArgs, typed: Vec<String>) {
        let opened = match args.open_for(&self.context, &self.run) {
            Ok(opened) => opened,
            Err(error) => return self.panel.error = Some(error.to_string()),
        };
        self.panel.error = None;
        self.panel.rays.clear();
        let again = args.path == self.subject.args.path;
        let before = std::mem::replace(&mut self.subject, Subject::new((args, typed), opened, &self.run));
        self.before.get_or_insert((before, self.eye, self.later_s));
        if !again {
            (self.eye, self.later_s) = (None, 0.0);
        }
        self.start();
    }

    /// The eye to move: from now on the camera is not the one that was asked for.
    fn eye(&mut self) -> &mut Eye {
        let (view, diagonal) = (self.subject.first_view(self.later_s), 0.5 * self.subject.diagonal_m);
        self.eye.get_or_insert_with(|| Eye::of(&view, diagonal))
    }

    /// Asks for a frame of what is to be seen now.
    fn ask(&mut self, moving: bool) {
        let (Some(worker), Some(shown)) = (&self.worker, &self.shown) else { return };
        let size = shown.screen.size();
        if size.0 == 0 || size.1 == 0 {
            return; // minimised
        }
        let view = self.eye.map_or_else(|| self.subject.first_view(self.later_s), |eye| eye.view());
        let job = Job {
            revision: self.asked.as_ref().map_or(1, |job| job.revision + 1),
            view,
            later_s: self.later_s,
            settings: self.panel.settings.clone(),
            size,
            layer: self.panel.layer,
            beside: self.panel.beside.settings(&self.panel.settings),
            exposure: self.panel.exposure,
            moving,
            refine: self.panel.refine,
        };
        worker.ask(job.clone());
        (self.asked, self.asked_at) = (Some(job), Instant::now());
    }

    fn moves(&mut self) {
        self.moved = Some(Instant::now());
        self.ask(true);
    }

    /// What held keys and the animation do since the last step.
    fn step(&mut self) {
        let since = self.stepped.elapsed().min(LONGEST_STEP).as_secs_f64();
        self.stepped = Instant::now();
        let along = |more, less| {
            f64::from(u8::from(self.held.contains(&more))) - f64::from(u8::from(self.held.contains(&less)))
        };
        let by = DVec3::new(
            along(KeyCode::KeyD, KeyCode::KeyA),
            along(KeyCode::KeyE, KeyCode::KeyQ),
            along(KeyCode::KeyW, KeyCode::KeyS),
        );
        let walks = by != DVec3::ZERO;
        if walks {
            let metres = self.speed * self.subject.diagonal_m * since;
            self.eye().walk(by * metres);
        }
        // An animation waits for the frames that it is shown in.
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

    /// Whether the last thing asked for is answered, whole.
    fn rests(&self) -> bool {
        let last = self.asked.as_ref().is_some_and(|job| !job.moving && job.revision == self.answered);
        last && self.whole && self.moved.is_none()
    }

    fn redraw(&self) {
        if let Some(shown) = &self.shown {
            shown.window.request_redraw();
        }
    }

    /// The settings that make what is shown: of a refined picture, with as many passes.
    fn settings(&self) -> Settings {
        let mut settings = self.panel.settings.clone();
        if let Some((_, frame)) = self.frame.as_ref().filter(|_| self.rests()) {
            settings.image.passes = settings.image.passes.max(frame.refined.passes);
        }
        settings
    }

    fn command(&self) -> String {
        let exposure = self.panel.exposure.or(self.frame.as_ref().map(|(_, frame)| frame.exposure_ev));
        let seen = Seen {
            typed: &self.subject.typed,
            eye: self.eye,
            time_s: self.subject.args.time + self.later_s,
            size: self.shown.as_ref().map_or(self.subject.args.size, |shown| shown.screen.size()),
            preset: &self.panel.preset,
            settings: &self.settings(),
            exposure_ev: exposure.unwrap_or(0.0),
        };
        seen.command()
    }

    /// Writes the image that is shown as a PNG, and beside it as an EXR with the settings.
    fn save(&self, path: &Path) -> anyhow::Result<()> {
        let (_, frame) = self.frame.as_ref().context("there is no picture to save yet: wait for the first")?;
        let mut image = frame.image.clone();
        image.layers.retain(|(layer, _)| *layer != Aov::Alpha);
        image.write_png(path, frame.exposure_ev)?;
        let exr = path.with_extension("exr");
        let header = [("settings", self.settings().to_toml()), ("command", self.command())];
        let header = header.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        image.write_exr(&exr, &header)?;
        say!("wrote {} and {}", out::name(path), out::name(&exr));
        Ok(())
    }

    fn take_answer(&mut self) -> anyhow::Result<()> {
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
                Some((subject, eye, later_s)) => {
                    (self.subject, self.eye, self.later_s) = (subject, eye, later_s);
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
    fn take_reload(&mut self) {
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

    fn set_title(&self) {
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

    /// Starts and ends the path tracer, and mixes what it found into the picture.
    fn compare(&mut self) -> anyhow::Result<()> {
        let Some((revision, frame)) = &self.frame else { return Ok(()) };
        let newest = self.rests() && *revision == self.answered;
        let wanted = self.panel.truth && newest && self.panel.layer == Layer::BEAUTY;
        if self.truth.as_ref().is_some_and(|truth| !wanted || truth.revision != *revision) {
            (self.truth, self.compared) = (None, None);
        }
        if wanted && self.truth.is_none() {
            let job = self.asked.as_ref().context("a picture that nobody asked for")?;
            let Subject { scene, shot, .. } = &self.subject;
            let of = (scene.clone(), shot.pose(scene, job.later_s), job.view);
            self.truth = Some(Truth::begin(*revision, of, frame.image.clone(), self.proxy.clone()));
        }
        if let Some(compared) = self.truth.as_ref().and_then(Truth::take) {
            self.compared = Some(compared);
        }
        let panel = &self.panel;
        let mixed = match (&self.compared, &frame.beside) {
            (Some(compared), _) => Mixed::Truth(panel.fade, compared.samples),
            (None, Some(_)) => Mixed::Beside(panel.mix, panel.split, panel.mix == Mix::Flicker && self.flickers()),
            (None, None) => Mixed::Plain,
        };
        if self.mixed == Some(mixed) {
            return Ok(());
        }
        let picture = match (mixed, &self.compared) {
            (Mixed::Truth(fade, _), Some(compared)) => Some(compared.picture(frame, fade)),
            (Mixed::Beside(mix, split, other), _) => beside::picture(frame, panel.layer, mix, (split, other)),
            _ => None,
        };
        if let Some(shown) = &mut self.shown {
            shown.screen.set_picture(picture.as_ref().unwrap_or(&frame.picture))?;
            self.mixed = Some(mixed);
        }
        Ok(())
    }

    /// Whether it is the turn of what is beside.
    fn flickers(&self) -> bool {
        (self.opened.elapsed().as_secs_f64() / FLICKER_S) as u64 % 2 == 1
    }

    fn draw(&mut self, grab: Option<&Path>) -> anyhow::Result<()> {
        if let Some(worker) = &self.worker {
            worker.hold(self.panel.truth);
        }
        self.compare()?;
        self.drawn = Instant::now();
        let Some(shown) = &mut self.shown else { return Ok(()) };
        let input = shown.egui.take_egui_input(&shown.window);
        let context = shown.egui.egui_ctx().clone();
        let (panel, frame) = (&mut self.panel, self.frame.as_ref().map(|(_, frame)| frame));
        let compared = self.compared.as_ref();
        let step = self.worker.as_ref().and_then(Worker::step);
        let mut changed = false;
        let size = shown.screen.size();
        let output = context.run_ui(input, |ui| {
            if let Some(frame) = frame {
                let lines = Lines::new(ui.ctx(), &frame.view, size);
                if panel.bounds {
                    lines.boxes(&frame.boxes);
                }
                lines.rays(&panel.rays, frame.exposure_ev);
            }
            changed |= panel.show(ui.ctx(), (frame, compared), step);
        });
        if let (Some(worker), Some(question)) = (&self.worker, panel.question.take()) {
            worker.put(question);
        }
        shown.egui.handle_platform_output(&shown.window, output.platform_output);
        let pixels_per_point = output.pixels_per_point;
        let primitives = context.tessellate(output.shapes, pixels_per_point);
        let overlay = Overlay { textures: output.textures_delta, primitives, pixels_per_point, window: &shown.window };
        let grabbed = shown.screen.draw(overlay, grab.is_some())?;
        let resized = shown.screen.size() != size;
        if let (Some(path), Some(picture)) = (grab, grabbed) {
            let rgb = picture.rgba.chunks_exact(4).flat_map(|p| p[..3].to_vec()).collect();
            file::write(path, &twobounce::output::png::encode_rgb(picture.size.0, picture.size.1, rgb)?)?;
        }
        if changed || resized {
            self.moves();
        }
        Ok(())
    }

    fn or_fail(&mut self, event_loop: &ActiveEventLoop, result: anyhow::Result<()>) {
        if let Err(error) = result.or_else(|error| self.recover(error)) {
            self.failed.get_or_insert(error);
            event_loop.exit();
        }
    }
}
