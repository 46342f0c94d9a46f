//! Events of the window system: keys, the mouse, dropped files, a new size.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::WindowId;

use super::beside::{Mix, Other};
use super::job::News;
use super::question::Question;
use super::{App, WAYS};
use crate::cli::{interrupt, out};
use crate::say;

/// The interval of movement steps.
const TICK: Duration = Duration::from_millis(16);
/// The interval of showing a frame's progress: on a CPU device, drawing it takes time from the frame.
const PROGRESS: Duration = Duration::from_millis(100);
/// Radians by which the view rotates when the mouse crosses the window's height.
const TURN: f64 = 2.0;
/// The factor of the speed for each notch of the mouse wheel.
const NOTCH: f64 = 1.25;

impl ApplicationHandler<News> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_none() {
            let opened = self.open(event_loop);
            self.or_fail(event_loop, opened);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, news: News) {
        let taken = self.take(news);
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
                    MouseButton::Right if pressed => self.ask_rays(),
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
        if self.rests() && std::mem::take(&mut self.saves) {
            self.save_anew();
        }
        let acted = self.act(event_loop);
        self.or_fail(event_loop, acted);
        let busy = !self.rests() || self.plays || !self.script.is_done();
        let flickers = self.panel.choice.beside != Other::None && self.panel.mixing.mix == Mix::Flicker;
        let changes = (!self.rests() || flickers) && self.drawn.elapsed() > PROGRESS;
        if self.panel.forgets() || changes {
            self.redraw(); // for the frame's progress, or the other picture's turn
        }
        let next = Instant::now() + if busy { TICK } else { 10 * TICK };
        event_loop.set_control_flow(ControlFlow::WaitUntil(next));
    }
}

impl App {
    /// Requests the rays of the pixel under the pointer.
    pub(super) fn ask_rays(&mut self) {
        let (Some((x, y)), Some(shown), Some(frame)) = (self.pointer, &self.shown, &self.frame) else { return };
        let (size, window) = (frame.picture.size, shown.screen.size());
        let pixel = |at: f64, size: u32, window: u32| (at * f64::from(size) / f64::from(window.max(1))) as u32;
        let pixel = (pixel(x, size.0, window.0).min(size.0 - 1), pixel(y, size.1, window.1).min(size.1 - 1));
        self.panel.question = Some(Question::Rays(pixel));
        self.redraw();
    }

    /// Saves the picture under a free name, and says so.
    fn save_anew(&mut self) {
        let name = &self.subject.scene.name;
        let numbered = (2..).map(|number| format!("{name}-{number}.png"));
        let paths = std::iter::once(format!("{name}.png")).chain(numbered).map(PathBuf::from);
        let is_free = |path: &PathBuf| !path.exists() && !path.with_extension("exr").exists();
        let Some(path) = paths.into_iter().find(is_free) else { return };
        let words = match self.save(&path) {
            Ok(()) => format!("saved {} and {}", path.display(), path.with_extension("exr").display()),
            Err(error) => {
                out::warn(&format!("{error:#}"));
                format!("{error:#}")
            }
        };
        self.panel.say(words);
        self.redraw();
    }

    pub(super) fn key(&mut self, event_loop: &ActiveEventLoop, key: KeyCode, pressed: bool) {
        if !pressed {
            self.held.remove(&key);
            return;
        }
        match key {
            // An open list receives the key.
            KeyCode::Escape => {
                let lists = |shown: &super::OpenWindow| egui::Popup::is_any_open(shown.egui.egui_ctx());
                if !self.shown.as_ref().is_some_and(lists) {
                    event_loop.exit();
                }
            }
            KeyCode::Tab => self.panel.open = !self.panel.open,
            KeyCode::Space => {
                self.plays = !self.plays;
                self.played = Instant::now();
            }
            KeyCode::KeyF => {
                self.eye = Some(self.subject.framing);
                self.moves();
            }
            KeyCode::KeyR => {
                let (args, typed) = (self.subject.args.clone(), self.subject.typed.clone());
                self.reopen(args, typed);
            }
            KeyCode::KeyC => {
                say!("{}", self.command());
                self.panel.say("the command of this picture is printed on the terminal".into());
            }
            KeyCode::KeyP => {
                self.saves = true;
                if !self.rests() {
                    self.panel.say("the picture is saved when it is finished".into());
                }
            }
            key if key == KeyCode::AltLeft || WAYS.iter().any(|(way, _)| *way == key) => {
                if self.held.is_empty() {
                    self.stepped = Instant::now();
                }
                self.held.insert(key);
            }
            _ => {}
        }
        self.redraw();
    }
}
