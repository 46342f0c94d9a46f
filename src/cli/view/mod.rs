//! `twobounce view`: a scene in a window. [`worker`] makes frames on a thread, [`screen`] shows them, [`panel`] has the settings,
//! [`eye`] is what keys and mouse move, [`layer`] what of a frame is shown, [`beside`] other settings next to it, [`truth`] the path tracer beside, [`script`] plays a user for tests.

mod beside;
mod command;
mod eye;
mod layer;
mod panel;
mod screen;
mod script;
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
use twobounce::scene::Scene;
use twobounce::settings::Settings;
use twobounce::vk::Context;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

use super::args::{RunArgs, SceneArgs, SettingsArgs, number};
use super::scene::{Opened, Shot};
use super::{interrupt, out};
use crate::say;
use beside::Mix;
use command::Seen;
use eye::Eye;
use layer::Layer;
use panel::Panel;
use screen::{Overlay, Screen};
use script::{Act, Script};
use truth::{Compared, Truth};
use worker::{Frame, Job, Stage, Worker};

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
/// Movement is looked at this often.
const TICK: Duration = Duration::from_millis(16);
/// Radians that the view turns when the mouse crosses the window's height.
const TURN: f64 = 2.0;
/// The scene's diagonals that a held key goes in a second, at first.
const SPEED: f64 = 0.15;
/// Seconds that each of two pictures is shown by turns.
const FLICKER_S: f64 = 0.5;
/// By how much a notch of the mouse wheel changes that.
const NOTCH: f64 = 1.25;

pub const KEYS: &str = "W A S D, Q E  move\nleft button  look about\nmiddle, or Alt and left  orbit\nwheel  speed\nF  frame the scene\n\
Space  play or pause\nR  read the scene's file again; a file dropped here is shown instead\nC  print the command of this picture\nP  save it as PNG and EXR\nTab  panel\nEsc  close";

/// Opens the window, and stays until it is closed. `typed`: scene and flags, as `render` takes them too.
pub fn run(args: &ViewArgs, typed: Vec<String>) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    args.scene.check()?;
    let script = args.script.as_deref().map(Script::read).transpose()?.unwrap_or_default();
    interrupt::install()?;
    let no_window = |e: &dyn std::fmt::Display| anyhow!("no window can be opened ({e}): use twobounce render");
    let event_loop = EventLoop::new().map_err(|e| no_window(&e))?;
    let (opened, context) = args.scene.open_on(&args.run)?;
    let mut app = App::new((args, typed), (opened, &context), settings, script, event_loop.create_proxy());
    drop(context);
    event_loop.run_app(&mut app).map_err(|e| no_window(&e))?;
    drop(app.worker.take());
    drop(app.shown.take());
    if let Some(error) = app.failed {
        return Err(error);
    }
    interrupt::check()?;
    Screen::refuse_invalid()?;
    twobounce::measure::refuse_invalid(&app.context)?;
    Ok(ExitCode::SUCCESS)
}

/// What the picture on the screen is mixed of.
#[derive(Clone, Copy, PartialEq)]
enum Mixed {
    Not,
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
    /// What is open, and how.
    scene: SceneArgs,
    run: RunArgs,
    context: Arc<Context>,
    typed: Vec<String>,
    name: String,
    opened: Instant,
    /// For a worker to be started.
    stage: Option<Stage>,
    proxy: EventLoopProxy<()>,
    worker: Option<Worker>,
    shown: Option<Shown>,
    panel: Panel,
    script: Script,
    first_size: (u32, u32),
    /// `None`: the camera that was asked for, at its place.
    eye: Option<Eye>,
    first_view: Box<dyn Fn(f64) -> twobounce::scene::View>,
    framing: Eye,
    diagonal_m: f64,
    speed: f64,
    held: HashSet<KeyCode>,
    pointer: Option<(f64, f64)>,
    buttons: (bool, bool),
    start_s: f64,
    later_s: f64,
    plays: bool,
    stepped: Instant,
    /// When the animation went on last.
    played: Instant,
    moved: Option<Instant>,
    asked: Option<Job>,
    /// When the newest job was asked for.
    asked_at: Instant,
    frame: Option<(u64, Frame)>,
    truth: Option<Truth>,
    compared: Option<Compared>,
    mixed: Mixed,
    of: Arc<Scene>,
    shot: Shot,
    failed: Option<anyhow::Error>,
}

/// What an opened scene brings.
struct Place {
    stage: Stage,
    first_view: Box<dyn Fn(f64) -> twobounce::scene::View>,
    framing: Eye,
    diagonal_m: f64,
}

impl Place {
    fn of(opened: Opened, run: &RunArgs, context: &Arc<Context>) -> Self {
        let options = opened.run_options(run);
        let Opened { scene, shot, .. } = opened;
        let bounds = options.bounds;
        let diagonal_m = bounds.size().length().max(1e-3);
        let framing = Eye::of(&twobounce::scene::View::framing(bounds), 1.0);
        let distance = (bounds.center() - framing.eye).length();
        let framing = Eye { target: framing.eye + (framing.target - framing.eye) * distance, ..framing };
        let scene = Arc::new(scene);
        let (cameras, of_shot) = (scene.clone(), shot.clone());
        let first_view = Box::new(move |later_s: f64| of_shot.view(&cameras, &of_shot.pose(&cameras, later_s)));
        let stage = Stage { context: context.clone(), scene, shot, options };
        Self { stage, first_view, framing, diagonal_m }
    }
}

impl App {
    fn new(
        (args, typed): (&ViewArgs, Vec<String>),
        (opened, context): (Opened, &Arc<Context>),
        settings: Settings,
        script: Script,
        proxy: EventLoopProxy<()>,
    ) -> Self {
        let run = args.run.clone();
        let Place { stage, first_view, framing, diagonal_m } = Place::of(opened, &run, context);
        Self {
            scene: args.scene.clone(),
            run,
            context: context.clone(),
            typed,
            name: stage.scene.name.clone(),
            opened: Instant::now(),
            of: stage.scene.clone(),
            shot: stage.shot.clone(),
            stage: Some(stage),
            proxy,
            worker: None,
            shown: None,
            panel: Panel::new(&args.settings.preset, settings, args.exposure.map(|ev| ev as f32)),
            script,
            first_size: args.scene.size,
            eye: None,
            first_view,
            framing,
            diagonal_m,
            speed: SPEED,
            held: HashSet::new(),
            pointer: None,
            buttons: (false, false),
            start_s: args.scene.time,
            later_s: 0.0,
            plays: args.play,
            stepped: Instant::now(),
            played: Instant::now(),
            moved: None,
            asked: None,
            asked_at: Instant::now(),
            frame: None,
            truth: None,
            compared: None,
            mixed: Mixed::Not,
            failed: None,
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> anyhow::Result<()> {
        let size = PhysicalSize::new(self.first_size.0, self.first_size.1);
        let attributes = Window::default_attributes().with_title(&self.name).with_inner_size(size);
        let window = event_loop
            .create_window(attributes)
            .map_err(|e| anyhow!("no window can be opened ({e}): use twobounce render"))?;
        let screen = Screen::new(&window, &self.context.name, self.run.device.validation)?;
        let context = egui::Context::default();
        let side = Some(4096);
        let egui = egui_winit::State::new(context, egui::ViewportId::ROOT, &window, None, None, side);
        self.shown = Some(Shown { egui, screen, window });
        self.start();
        Ok(())
    }

    /// Starts to make frames of the scene that was opened last.
    fn start(&mut self) {
        let Some(stage) = self.stage.take() else { return };
        self.worker = Some(Worker::start(stage, self.proxy.clone()));
        self.moves(); // a coarse picture comes first
    }

    /// Another scene, as `twobounce view` shows it without flags.
    fn dropped(&mut self, path: &Path) {
        self.reopen(SceneArgs::plain(path, self.scene.size));
    }

    /// Opens a scene instead of the one that is shown; where that fails, says why, and keeps what there is.
    fn reopen(&mut self, scene: SceneArgs) {
        let again = scene.path == self.scene.path;
        let (opened, context) = match scene.open_on(&self.run) {
            Ok(opened) => opened,
            Err(error) => return self.panel.error = Some(error.to_string()),
        };
        if let Err(error) = twobounce::measure::refuse_invalid(&self.context) {
            self.failed.get_or_insert(error.into());
        }
        self.worker = None; // waits for its frame
        let Place { stage, first_view, framing, diagonal_m } = Place::of(opened, &self.run, &context);
        (self.first_view, self.framing, self.diagonal_m) = (first_view, framing, diagonal_m);
        (self.name, self.of, self.shot) = (stage.scene.name.clone(), stage.scene.clone(), stage.shot.clone());
        if !again {
            (self.eye, self.later_s, self.start_s) = (None, 0.0, scene.time);
            self.typed = vec![scene.path.to_string_lossy().into_owned()];
        }
        (self.stage, self.context, self.scene) = (Some(stage), context, scene);
        (self.frame, self.truth, self.compared, self.mixed) = (None, None, None, Mixed::Not);
        self.panel.error = None;
        self.start();
    }

    /// The eye to move: from now on the camera is not the one that was asked for.
    fn eye(&mut self) -> &mut Eye {
        let (view, diagonal) = ((self.first_view)(self.later_s), 0.5 * self.diagonal_m);
        self.eye.get_or_insert_with(|| Eye::of(&view, diagonal))
    }

    /// Asks for a frame of what is to be seen now.
    fn ask(&mut self, moving: bool) {
        let (Some(worker), Some(shown)) = (&self.worker, &self.shown) else { return };
        let size = shown.screen.size();
        if size.0 == 0 || size.1 == 0 {
            return; // minimised
        }
        let view = self.eye.map_or_else(|| (self.first_view)(self.later_s), |eye| eye.view());
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
            let metres = self.speed * self.diagonal_m * since;
            self.eye().walk(by * metres);
        }
        // An animation waits for the frames that it is shown in.
        let shows = self.frame.as_ref().map(|(revision, _)| *revision) == self.asked.as_ref().map(|job| job.revision);
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

    /// Whether what is shown is the last thing asked for, whole.
    fn rests(&self) -> bool {
        let newest = self.asked.as_ref().is_some_and(|job| !job.moving);
        newest
            && self.moved.is_none()
            && self.frame.as_ref().map(|(r, _)| *r) == self.asked.as_ref().map(|j| j.revision)
    }

    fn key(&mut self, event_loop: &ActiveEventLoop, key: KeyCode, pressed: bool) {
        if !pressed {
            self.held.remove(&key);
            return;
        }
        match key {
            KeyCode::Escape => event_loop.exit(),
            KeyCode::Tab => self.panel.open = !self.panel.open,
            KeyCode::Space => {
                self.plays = !self.plays;
                self.played = Instant::now();
            }
            KeyCode::KeyF => {
                self.eye = Some(self.framing);
                self.moves();
            }
            KeyCode::KeyR => {
                let scene = self.scene.clone();
                self.reopen(scene);
            }
            KeyCode::KeyC => say!("{}", self.command()),
            KeyCode::KeyP => {
                let saved = self.save(&PathBuf::from(format!("{}.png", self.name)));
                saved.unwrap_or_else(|error| out::warn(&format!("{error:#}")));
            }
            KeyCode::KeyW | KeyCode::KeyA | KeyCode::KeyS | KeyCode::KeyD | KeyCode::KeyQ | KeyCode::KeyE => {
                if self.held.is_empty() {
                    self.stepped = Instant::now();
                }
                self.held.insert(key);
            }
            _ => {}
        }
        self.redraw();
    }

    fn redraw(&self) {
        if let Some(shown) = &self.shown {
            shown.window.request_redraw();
        }
    }

    fn command(&self) -> String {
        let exposure = self.panel.exposure.or(self.frame.as_ref().map(|(_, frame)| frame.exposure_ev));
        let seen = Seen {
            typed: &self.typed,
            eye: self.eye,
            time_s: self.start_s + self.later_s,
            size: self.shown.as_ref().map_or(self.first_size, |shown| shown.screen.size()),
            preset: &self.panel.preset,
            settings: &self.panel.settings,
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
        let header = [("settings", self.panel.settings.to_toml()), ("command", self.command())];
        let header = header.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        image.write_exr(&exr, &header)?;
        say!("wrote {} and {}", out::name(path), out::name(&exr));
        Ok(())
    }

    fn take_answer(&mut self) -> anyhow::Result<()> {
        let Some(answer) = self.worker.as_ref().and_then(Worker::answer) else { return Ok(()) };
        match answer.frame {
            Err(words) if self.frame.is_none() => return Err(anyhow!(words)),
            Err(words) => self.panel.error = Some(words),
            Ok(frame) => {
                self.panel.error = None;
                if let Some(shown) = &mut self.shown {
                    shown.screen.set_picture(&frame.picture)?;
                    let (width, height) = shown.screen.size();
                    let coarse = match frame.divisor {
                        1 => String::new(),
                        by => format!(" at 1/{by}"),
                    };
                    let title = format!(
                        "{} · {width}x{height}{coarse} · {:.0} ms · {}",
                        self.name, frame.ms, self.context.name
                    );
                    shown.window.set_title(&title);
                }
                if self.asked.as_ref().is_some_and(|job| job.revision == answer.revision) {
                    self.script.answered(self.asked_at.elapsed());
                }
                self.mixed = Mixed::Not;
                (self.truth, self.compared) = (None, None);
                self.frame = Some((answer.revision, frame));
            }
        }
        Ok(())
    }

    /// Starts and ends the path tracer, and mixes what it found into the picture.
    fn compare(&mut self) -> anyhow::Result<()> {
        let Some((revision, frame)) = &self.frame else { return Ok(()) };
        let wanted = self.panel.truth && self.rests() && self.panel.layer == Layer::BEAUTY;
        if self.truth.as_ref().is_some_and(|truth| !wanted || truth.revision != *revision) {
            (self.truth, self.compared) = (None, None);
        }
        if wanted && self.truth.is_none() {
            let job = self.asked.as_ref().context("a picture that nobody asked for")?;
            let pose = self.shot.pose(&self.of, job.later_s);
            let of = (self.of.clone(), pose, job.view);
            self.truth = Some(Truth::begin(*revision, of, frame.image.clone(), self.proxy.clone()));
        }
        if let Some(compared) = self.truth.as_ref().and_then(Truth::take) {
            self.compared = Some(compared);
        }
        let panel = &self.panel;
        let mixed = match (&self.compared, &frame.beside) {
            (Some(compared), _) => Mixed::Truth(panel.fade, compared.samples),
            (None, Some(_)) => Mixed::Beside(panel.mix, panel.split, panel.mix == Mix::Flicker && self.flickers()),
            (None, None) => Mixed::Not,
        };
        if self.mixed != mixed {
            let picture = match (mixed, &self.compared) {
                (Mixed::Truth(fade, _), Some(compared)) => Some(compared.picture(frame, fade)),
                (Mixed::Beside(mix, split, other), _) => beside::picture(frame, panel.layer, mix, (split, other)),
                _ => None,
            };
            if let Some(shown) = &mut self.shown {
                shown.screen.set_picture(picture.as_ref().unwrap_or(&frame.picture))?;
            }
            self.mixed = mixed;
        }
        Ok(())
    }

    /// Whether it is the turn of what is beside.
    fn flickers(&self) -> bool {
        (self.opened.elapsed().as_secs_f64() / FLICKER_S) as u64 % 2 == 1
    }

    fn draw(&mut self, grab: Option<&Path>) -> anyhow::Result<()> {
        self.compare()?;
        let Some(shown) = &mut self.shown else { return Ok(()) };
        let input = shown.egui.take_egui_input(&shown.window);
        let context = shown.egui.egui_ctx().clone();
        let (panel, frame) = (&mut self.panel, self.frame.as_ref().map(|(_, frame)| frame));
        let compared = self.compared.as_ref();
        let step = self.worker.as_ref().and_then(Worker::step);
        let mut changed = false;
        let output = context.run_ui(input, |ui| changed |= panel.show(ui.ctx(), (frame, compared), step));
        shown.egui.handle_platform_output(&shown.window, output.platform_output);
        let pixels_per_point = output.pixels_per_point;
        let primitives = context.tessellate(output.shapes, pixels_per_point);
        let size = shown.screen.size();
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

    /// One line of the script, once nothing is under way.
    fn act(&mut self, event_loop: &ActiveEventLoop) -> anyhow::Result<()> {
        if self.frame.is_none() || self.script.waits(self.rests(), self.compared.is_some(), self.later_s) {
            return Ok(());
        }
        let Some(act) = self.script.next() else { return Ok(()) };
        let Some(shown) = &mut self.shown else { return Ok(()) };
        match act {
            Act::Rest | Act::Wait(_) => {}
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
            Act::Drop(path) => self.dropped(&path),
            Act::Size(width, height) => drop(shown.window.request_inner_size(PhysicalSize::new(width, height))),
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
                say!("swapchains {made}; {}{error}", self.script.answers());
            }
            Act::Quit => event_loop.exit(),
        }
        self.redraw();
        Ok(())
    }

    fn or_fail(&mut self, event_loop: &ActiveEventLoop, result: anyhow::Result<()>) {
        if let Err(error) = result {
            self.failed.get_or_insert(error);
            event_loop.exit();
        }
    }
}

impl ApplicationHandler<()> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_none() {
            let opened = self.open(event_loop);
            self.or_fail(event_loop, opened);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, (): ()) {
        let taken = self.take_answer();
        self.or_fail(event_loop, taken);
        self.redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        let response = shown.egui.on_window_event(&shown.window, &event);
        if response.repaint {
            shown.window.request_redraw();
        }
        let height = f64::from(shown.screen.size().1.max(1));
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => {
                let drawn = self.draw(None);
                self.or_fail(event_loop, drawn);
            }
            WindowEvent::Resized(_) => {
                let made = shown.screen.remake(&shown.window);
                self.or_fail(event_loop, made);
                self.moves();
                self.redraw();
            }
            WindowEvent::Focused(false) => self.held.clear(),
            WindowEvent::DroppedFile(path) => self.dropped(&path),
            WindowEvent::KeyboardInput { event, .. } => {
                let PhysicalKey::Code(key) = event.physical_key else { return };
                let pressed = event.state == ElementState::Pressed;
                if !response.consumed && !event.repeat || !pressed {
                    self.key(event_loop, key, pressed);
                }
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let pressed = state == ElementState::Pressed && !response.consumed;
                match button {
                    MouseButton::Left => self.buttons.0 = pressed,
                    MouseButton::Middle => self.buttons.1 = pressed,
                    _ => {}
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !response.consumed => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, y) => f64::from(y),
                    MouseScrollDelta::PixelDelta(by) => by.y / 50.0,
                };
                self.speed = (self.speed * NOTCH.powf(notches)).clamp(1e-4, 1e2);
            }
            WindowEvent::CursorMoved { position, .. } => {
                let (x, y) = (position.x, position.y);
                let before = self.pointer.replace((x, y));
                let Some((old_x, old_y)) = before.filter(|_| self.buttons.0 || self.buttons.1) else { return };
                let (left, up) = (TURN * (old_x - x) / height, TURN * (old_y - y) / height);
                let alt = self.held.contains(&KeyCode::AltLeft);
                if self.buttons.1 || alt {
                    self.eye().orbit(left, up)
                } else {
                    self.eye().turn(left, up)
                }
                self.moves();
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if interrupt::check().is_err() {
            return event_loop.exit();
        }
        self.step();
        let acted = self.act(event_loop);
        self.or_fail(event_loop, acted);
        let busy = !self.rests() || self.plays || !self.script.is_done();
        let flickers = self.panel.beside != beside::Other::None && self.panel.mix == Mix::Flicker;
        if !self.rests() || flickers {
            self.redraw(); // how far the frame is, or the other's turn
        }
        let next = Instant::now() + if busy { TICK } else { 10 * TICK };
        event_loop.set_control_flow(ControlFlow::WaitUntil(next));
    }
}
