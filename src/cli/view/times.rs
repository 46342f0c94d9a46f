//! Times of frames: the passes of the last one as a tree, and a graph of earlier ones.

use std::collections::VecDeque;

use twobounce::memory::mib;
use twobounce::vk::ZoneTiming;

use super::job::ShownFrame;
use crate::cli::progress::course::IMAGE_PASSES;

/// The number of frames in the graph.
const FRAMES: usize = 160;
/// Height of the graph in points.
const HEIGHT: f32 = 60.0;
/// Passes that make lists, for any method; passes that are neither these nor the image are light.
const LIST_PASSES: [&str; 8] = ["reset", "deform", "record", "tree", "voxelise", "cells", "group", "split"];
const GROUPS: [(&str, egui::Color32); 3] = [
    ("lists", egui::Color32::from_rgb(90, 130, 220)),
    ("light", egui::Color32::from_rgb(230, 170, 60)),
    ("image", egui::Color32::from_rgb(110, 190, 110)),
];

/// Milliseconds of lists, light and image of the last frames.
#[derive(Default)]
pub struct History {
    frames: VecDeque<[f64; 3]>,
}

fn group(name: &str) -> usize {
    match name {
        name if LIST_PASSES.contains(&name) => 0,
        name if IMAGE_PASSES.contains(&name) => 2,
        _ => 1,
    }
}

fn sum<'a>(zones: impl IntoIterator<Item = &'a ZoneTiming>) -> f64 {
    zones.into_iter().map(|zone| zone.gpu_ms).sum()
}

impl History {
    /// Adds a frame.
    pub fn add(&mut self, frame: &ShownFrame) {
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        let zones = &frame.report.timings.zones;
        self.frames.push_back([0, 1, 2].map(|at| sum(zones.iter().filter(|zone| group(zone.name) == at))));
    }

    /// Shows bars, the newest on the right.
    fn show(&self, ui: &mut egui::Ui) {
        let highest = self.frames.iter().map(|parts| parts.iter().sum::<f64>()).fold(0.0, f64::max);
        let (response, painter) = ui.allocate_painter(egui::vec2(ui.available_width(), HEIGHT), egui::Sense::hover());
        let area = response.rect;
        painter.rect_filled(area, 0.0, egui::Color32::from_gray(25));
        let width = area.width() / FRAMES as f32;
        for (at, parts) in self.frames.iter().rev().enumerate() {
            let right = area.right() - at as f32 * width;
            let mut bottom = area.bottom();
            for (part, (_, color)) in parts.iter().zip(GROUPS) {
                let height = (part / highest.max(1e-9)) as f32 * area.height();
                let bar = egui::Rect::from_min_max(
                    egui::pos2(right - width, bottom - height),
                    egui::pos2(right - 0.1 * width, bottom),
                );
                painter.rect_filled(bar, 0.0, color);
                bottom -= height;
            }
        }
        response.on_hover_text(format!("milliseconds of the last {FRAMES} frames; the highest took {highest:.1}"));
    }
}

/// Shows the graph, the passes, and the counters of the frame.
pub fn show(ui: &mut egui::Ui, frame: &ShownFrame, history: &History) {
    history.show(ui);
    let timings = &frame.report.timings;
    let all = sum(&timings.zones).max(1e-9);
    for (at, (name, color)) in GROUPS.into_iter().enumerate() {
        let made: Vec<&ZoneTiming> = timings.zones.iter().filter(|zone| group(zone.name) == at).collect();
        // Lists and light of earlier frames stay if nothing changed.
        let kept: Vec<&ZoneTiming> =
            frame.light.iter().filter(|zone| made.is_empty() && group(zone.name) == at).collect();
        let zones = if made.is_empty() { &kept } else { &made };
        if zones.is_empty() {
            continue;
        }
        let (ms, share) = (sum(zones.iter().copied()), sum(made.iter().copied()) / all);
        let words =
            if made.is_empty() { " in its last run, reused since".into() } else { format!(", {:.0} %", 100.0 * share) };
        let title = egui::RichText::new(format!("{name}: {ms:.2} ms{words}")).color(color);
        egui::CollapsingHeader::new(title).id_salt(name).default_open(true).show(ui, |ui| show_zones(ui, zones));
    }
    let counters = &frame.report.counters;
    ui.label(format!("passes {all:.1} ms, frame {:.1} ms", timings.wall_ms));
    ui.label(format!("triangles {}, list items {}", counters.triangles, counters.list_items));
    ui.label(format!("device memory {:.0} MiB", mib(frame.allocated_bytes)));
}

fn show_zones(ui: &mut egui::Ui, zones: &[&ZoneTiming]) {
    let longest = zones.iter().map(|zone| zone.gpu_ms).fold(1e-9, f64::max);
    egui::Grid::new(("times", zones[0].name)).striped(true).show(ui, |ui| {
        for zone in zones {
            ui.label(zone.name);
            ui.label(format!("{:.2} ms", zone.gpu_ms));
            ui.add(egui::ProgressBar::new((zone.gpu_ms / longest) as f32).desired_width(90.0));
            ui.end_row();
        }
    });
}
