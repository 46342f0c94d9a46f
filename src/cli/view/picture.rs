//! The picture on the screen: the frame, or what it is mixed with, lines over it, and the panel.

use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;
use twobounce::output::file;

use super::beside::{self, Mix, Mixing};
use super::layer::Layer;
use super::overlay::Lines;
use super::screen::Overlay;
use super::subject::Subject;
use super::truth::{Truth, TruthOf};
use super::worker::Worker;
use super::{App, FLICKER_S};

/// What the picture on the screen is, of a frame.
#[derive(Clone, Copy, PartialEq)]
pub enum Mixed {
    Plain,
    /// How far it is faded, and the reference's samples.
    Truth(f32, u32),
    /// How, where the line is, and whether it is the other's turn.
    Beside(Mixing),
}

impl App {
    /// Starts and ends the path tracer, and mixes what it found into the picture.
    pub(super) fn compare(&mut self) -> anyhow::Result<()> {
        let Some((revision, frame)) = &self.frame else { return Ok(()) };
        let newest = self.rests() && *revision == self.answered;
        let wanted = self.panel.truth && newest && self.panel.layer == Layer::BEAUTY;
        if self.truth.as_ref().is_some_and(|truth| !wanted || truth.revision != *revision) {
            (self.truth, self.compared) = (None, None);
        }
        if wanted && self.truth.is_none() {
            let job = self.asked.as_ref().context("a picture that nobody asked for")?;
            let Subject { scene, shot, .. } = &self.subject;
            let (pose, image) = (shot.pose(scene, job.later_s), frame.image.clone());
            let of = TruthOf { revision: *revision, scene: scene.clone(), pose, view: job.view, image };
            self.truth = Some(Truth::begin(of, self.proxy.clone()));
        }
        if let Some(compared) = self.truth.as_ref().and_then(Truth::take) {
            self.compared = Some(compared);
        }
        let panel = &self.panel;
        let mixed = match (&self.compared, &frame.beside) {
            (Some(compared), _) => Mixed::Truth(panel.fade, compared.samples),
            (None, Some(_)) => {
                let other = panel.mix == Mix::Flicker && self.flickers();
                Mixed::Beside(Mixing { mix: panel.mix, split: panel.split, other })
            }
            (None, None) => Mixed::Plain,
        };
        if self.mixed == Some(mixed) {
            return Ok(());
        }
        let picture = match (mixed, &self.compared) {
            (Mixed::Truth(fade, _), Some(compared)) => Some(compared.picture(frame, fade)),
            (Mixed::Beside(mixing), _) => beside::picture(frame, panel.layer, mixing),
            _ => None,
        };
        if let Some(shown) = &mut self.shown {
            shown.screen.set_picture(picture.as_ref().unwrap_or(&frame.picture))?;
            self.mixed = Some(mixed);
        }
        Ok(())
    }

    /// Whether it is the turn of what is beside.
    pub(super) fn flickers(&self) -> bool {
        (self.opened.elapsed().as_secs_f64() / FLICKER_S) as u64 % 2 == 1
    }

    pub(super) fn draw(&mut self, grab: Option<&Path>) -> anyhow::Result<()> {
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
            changed |= panel.show(ui.ctx(), frame, compared, step);
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
}
