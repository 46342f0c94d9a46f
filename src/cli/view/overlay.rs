//! Lines over the picture: the boxes of grids, and the rays of a pixel.

use glam::DVec3;
use twobounce::output::display::Display;
use twobounce::scene::View;

use super::question::GatherRay;

/// The projection of lines in the world to the screen.
pub struct Lines<'a> {
    painter: egui::Painter,
    view: &'a View,
    /// Size of the picture in pixels.
    size: (u32, u32),
    pixels_per_point: f32,
}

impl<'a> Lines<'a> {
    /// Lines over the picture and below the panel.
    pub fn new(context: &egui::Context, view: &'a View, size: (u32, u32)) -> Self {
        let painter = context.layer_painter(egui::LayerId::background());
        Self { painter, view, size, pixels_per_point: context.pixels_per_point() }
    }

    fn line(&self, ends: [DVec3; 2], stroke: egui::Stroke) {
        if let Some(ends) = self.view.segment(ends, self.size) {
            let at = |[x, y]: [f64; 2]| egui::pos2(x as f32, y as f32) / self.pixels_per_point;
            self.painter.line_segment(ends.map(at), stroke);
        }
    }

    /// The edges of boxes, each given by its least and its largest corner; the first one is the base grid's.
    pub fn boxes(&self, boxes: &[[DVec3; 2]]) {
        for (at, [least, most]) in boxes.iter().enumerate() {
            let color = if at == 0 { egui::Color32::YELLOW } else { egui::Color32::from_rgb(90, 200, 255) };
            let corner = |k: usize| DVec3::select(glam::BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0), *most, *least);
            for from in 0..8usize {
                for to in [1, 2, 4].map(|bit| from | bit).into_iter().filter(|to| *to != from) {
                    self.line([corner(from), corner(to)], egui::Stroke::new(1.0, color));
                }
            }
        }
    }

    /// Rays with the brightness of their radiance, exposed like the picture; black ones are grey.
    pub fn rays(&self, rays: &[GatherRay], display: Display) {
        for ray in rays {
            let [r, g, b] = display.codes(ray.light);
            let color = egui::Color32::from_rgb(r.max(60), g.max(60), b.max(60));
            self.line([ray.from, ray.to], egui::Stroke::new(1.0, color));
            if let Some([_, end]) = self.view.segment([ray.from, ray.to], self.size) {
                let at = egui::pos2(end[0] as f32, end[1] as f32) / self.pixels_per_point;
                self.painter.circle_filled(at, 2.0, color);
            }
        }
    }
}

/// The rays as text, the brightest first.
pub fn show_rays(ui: &mut egui::Ui, rays: &[GatherRay]) {
    let brightness = |ray: &GatherRay| ray.light.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    let all = rays.iter().map(brightness).sum::<f64>();
    ui.label(format!("{} rays, mean radiance {:.4}", rays.len(), all / rays.len().max(1) as f64));
    let mut sorted: Vec<&GatherRay> = rays.iter().collect();
    sorted.sort_by(|a, b| brightness(b).total_cmp(&brightness(a)));
    egui::Grid::new("rays").striped(true).show(ui, |ui| {
        for ray in sorted {
            ui.label(format!("{:.1} %", 100.0 * brightness(ray) / all.max(f64::MIN_POSITIVE)));
            ui.label(if ray.met.is_empty() { String::new() } else { format!("{:.2} m", ray.from.distance(ray.to)) });
            ui.label(if ray.met.is_empty() { "sky" } else { &ray.met });
            ui.end_row();
        }
    });
}
