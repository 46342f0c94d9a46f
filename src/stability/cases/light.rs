//! How much light arrives, where that is known.

use glam::DVec3;

use super::sum;
use super::walls::against_truth;
use crate::Result;
use crate::layers::Aov;
use crate::reference::Depth;
use crate::settings::{Bounces, LampLight};
use crate::stability::case::{Run, Sample};
use crate::stability::cell::Cell;
use crate::stability::scenes::{ROOM, corridor, furnace, lit_square, mirror_room, room, sphere};
use crate::stability::stage::Studio;

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("furnace-0.5", |cell| furnaces(cell, 0.5, false)),
    ("furnace-0.8", |cell| furnaces(cell, 0.8, false)),
    ("furnace-all", |cell| furnaces(cell, 0.5, true)),
    ("self-light-sphere", spheres),
    ("self-light-plane", planes),
    ("mirror-room", |cell| against_truth(cell, mirror_room(), |image, truth| sum(image) / sum(truth))),
    ("corridor", corridors),
    ("outside", outside),
];

fn furnaces(cell: &Cell, albedo: f32, all: bool) -> Result<Vec<Sample>> {
    let stage = furnace(albedo);
    let settings = if all { cell.changed("bounces=all")? } else { cell.settings.clone() };
    let albedo = f64::from(albedo);
    let ideal = match settings.bounces {
        Bounces::All => 1.0 / (1.0 - albedo),
        // Emission, its direct light, and as many bounces. The first gather finds the direct light of lamps that are gathered.
        finite => {
            let terms = finite.volumes() + 2 - u32::from(settings.lights.lamps == LampLight::Gathered);
            (0..terms).map(|k| albedo.powi(k as i32)).sum()
        }
    };
    let mut studio = Studio::with(cell, stage, settings, DVec3::ZERO)?;
    let sample = |place: &_| {
        let image = studio.shoot_anew(place)?;
        let values = image.beauty().iter().flatten().map(|v| f64::from(*v) / ideal);
        let (least, most) = values.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
        let number = sum(image.beauty()) / (3 * image.beauty().len()) as f64 / ideal;
        let more = vec![("least pixel", least), ("brightest pixel", most)];
        Ok(Sample { more, ..Sample::new(place, number, image.beauty().to_vec()) })
    };
    cell.turned_places().iter().map(sample).collect()
}

fn spheres(cell: &Cell) -> Result<Vec<Sample>> {
    let mut studio = Studio::new(cell, sphere())?;
    let sample = |place| {
        let image = studio.shoot(place)?;
        // Pixels at the sphere's outline show the sky too.
        let width = image.width as usize;
        let inside = |i: &usize| {
            let [x, y] = [i % width, i / width].map(|at| (at as f64 + 0.5) / width as f64 - 0.5);
            x.hypot(y) < 0.4
        };
        let pixels: Vec<[f32; 3]> = (0..width * width).filter(inside).map(|i| image.beauty()[i]).collect();
        let number = sum(&pixels) / (3 * pixels.len()) as f64 / 0.5;
        Ok(Sample::new(place, number, image.beauty().to_vec()))
    };
    cell.turned_places().iter().map(sample).collect()
}

fn planes(cell: &Cell) -> Result<Vec<Sample>> {
    let mut studio = Studio::new(cell, lit_square())?;
    let sample = |place| {
        let image = studio.shoot(place)?;
        let [indirect, direct] = [Aov::Indirect, Aov::Direct].map(|aov| sum(image.get(aov).unwrap_or_default()));
        Ok(Sample::new(place, indirect / direct, image.beauty().to_vec()))
    };
    cell.turned_places().iter().map(sample).collect()
}

fn outside(cell: &Cell) -> Result<Vec<Sample>> {
    let settings = cell.changed(&format!("grid.side={ROOM}"))?;
    let half = Cell::new(cell.context, cell.cache, settings, (cell.effort, cell.memory_limit), cell.cancel);
    let samples = against_truth(&half, room(), |image, truth| sum(image) / sum(truth))?;
    cell.took_as(&half);
    Ok(samples)
}

fn corridors(cell: &Cell) -> Result<Vec<Sample>> {
    let stage = corridor();
    let film = cell.film(&stage, (&stage.pose(), &stage.view), Depth::Full, 0)?;
    let truth = film.layers(&[]).beauty().to_vec();
    let settings = cell.changed("bounces=all")?;
    let mut studio = Studio::with(cell, stage, settings, DVec3::ZERO)?;
    let sample = |place: &_| {
        let image = studio.shoot_anew(place)?.beauty().to_vec();
        let number = sum(&image) / sum(&truth);
        Ok(Sample { truth: Some(truth.clone()), ..Sample::new(place, number, image) })
    };
    cell.turned_places().iter().map(sample).collect()
}
