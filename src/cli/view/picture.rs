//! The picture on the screen: the frame, or a mix with it, lines over it, and the panel.

use std::path::Path;
use std::time::Instant;

use twobounce::output::file;

use super::App;
use super::beside::{self, Mix, Mixing};
use super::layer::Layer;
use super::overlay::Lines;
use super::screen::Overlay;
use super::truth::Truth;

/// Seconds for which each of two alternating pictures is shown.
const FLICKER_S: f64 = 0.5;

/// The mix of the picture on the screen: the blend with the reference, the samples of the reference, and the mix with
/// the second picture.
pub type Mixed = (f32, Option<u32>, Mixing);

impl App {
    /// Starts and ends the path tracer, and mixes its result into the picture.
    pub(super) fn compare(&mut self) -> anyhow::Result<()> {
        let Some(frame) = &self.frame else { return Ok(()) };
        let newest = self.rests() && frame.job.revision == self.answered;
        let wanted = self.panel.truth && newest && self.panel.choice.layer == Layer::BEAUTY;
        if self.truth.as_ref().is_some_and(|truth| !wanted || truth.revision != frame.job.revision) {
            (self.truth, self.compared) = (None, None);
        }
        if wanted && self.truth.is_none() {
            self.truth = Some(Truth::begin(self.subject.scene.clone(), frame, self.proxy.clone())?);
        }
        let panel = &self.panel;
        let turns = (self.opened.elapsed().as_secs_f64() / FLICKER_S) as u64;
        let is_beside = frame.beside.is_some() && self.compared.is_none();
        let other = is_beside && panel.mixing.mix == Mix::Flicker && turns % 2 == 1;
        let mixing = Mixing { other, ..panel.mixing };
        let mixed = (panel.fade, self.compared.as_ref().map(|compared| compared.samples), mixing);
        if self.mixed == Some(mixed) {
            return Ok(());
        }
        let picture = match &self.compared {
            Some(compared) => Some(compared.picture(frame, panel.fade)),
            None => beside::picture(frame, panel.choice.layer, mixing),
        };
        if let Some(shown) = &mut self.shown {
            shown.screen.set_picture(picture.as_ref().unwrap_or(&frame.picture))?;
            self.mixed = Some(mixed);
        }
        Ok(())
    }

    pub(super) fn draw(&mut self, grab: Option<&Path>) -> anyhow::Result<()> {
        let step = self.worker.as_ref().and_then(|worker| {
            let mut state = worker.shared.lock();
            state.holds = self.panel.truth;
            state.step
        });
        self.compare()?;
        self.drawn = Instant::now();
        let Some(shown) = &mut self.shown else { return Ok(()) };
        let input = shown.egui.take_egui_input(&shown.window);
        let context = shown.egui.egui_ctx().clone();
        let (panel, frame) = (&mut self.panel, self.frame.as_ref());
        let compared = self.compared.as_ref();
        let size = shown.screen.size();
        let output = context.run_ui(input, |ui| {
            if let Some(frame) = frame {
                let lines = Lines::new(ui.ctx(), &frame.job.view, size);
                if panel.bounds {
                    lines.boxes(&frame.boxes);
                }
                lines.rays(&panel.rays, frame.display);
            }
            panel.show(ui.ctx(), frame, compared, step);
            // A picture that is grabbed without the panel contains nothing else.
            if grab.is_none() || panel.open {
                panel.show_notice(ui.ctx());
            }
        });
        if let (Some(worker), Some(question)) = (&self.worker, panel.question.take()) {
            worker.shared.change(|state| state.question = Some(question));
        }
        shown.egui.handle_platform_output(&shown.window, output.platform_output);
        let pixels_per_point = output.pixels_per_point;
        let primitives = context.tessellate(output.shapes, pixels_per_point);
        let overlay = Overlay { textures: output.textures_delta, primitives, pixels_per_point, window: &shown.window };
        let grabbed = shown.screen.draw(&overlay, grab.is_some())?;
        let resized = shown.screen.size() != size;
        if let (Some(path), Some(picture)) = (grab, grabbed) {
            let rgb = picture.rgba.chunks_exact(4).flat_map(|p| p[..3].to_vec()).collect();
            file::write(path, &twobounce::output::picture::encode_rgb(picture.size.0, picture.size.1, rgb)?)?;
        }
        let chosen = self.asked.as_ref().is_none_or(|job| job.choice == self.panel.choice);
        if !chosen || resized {
            self.moves();
        }
        Ok(())
    }
}
