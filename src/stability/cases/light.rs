//! How much light arrives, where that is known.

use glam::DVec3;

use super::sum;
use super::walls::against_truth;
use crate::Result;
use crate::layers::Aov;
use crate::reference::Depth;
use crate::settings::{Bounces, LampLight};
use crate::stability::case::{Case, Sample, Unit};
use crate::stability::cell::Cell;
use crate::stability::scenes::{ROOM, corridor, furnace, lit_square, mirror_room, room, sphere};
use crate::stability::stage::Studio;

pub const CASES: &[Case] = &[
    Case {
        name: "furnace-0.5",
        meaning: "The inside of a closed box that emits 1 and reflects ½: radiance over the sum that as many bounces give.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.01,
        advice: "Light is lost or made at every bounce: correct for it with exposure, or use the method rays.",
        quick: true,
        run: |cell| furnaces(cell, 0.5, false),
    },
    Case {
        name: "furnace-0.8",
        meaning: "The same, of walls that reflect 0.8.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.01,
        advice: "In bright rooms the error of each bounce adds up: prefer the method rays there.",
        quick: false,
        run: |cell| furnaces(cell, 0.8, false),
    },
    Case {
        name: "furnace-all",
        meaning: "The same, of walls that reflect ½, with all bounces: radiance over 2.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.01,
        advice: "With bounces = all an error feeds back into itself: prefer two bounces, or the method rays.",
        quick: false,
        run: |cell| furnaces(cell, 0.5, true),
    },
    Case {
        name: "self-light-sphere",
        meaning: "A sphere of albedo ½ under an even sky of 1, which occludes nothing of itself: mean radiance over ½.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.01,
        advice: "Smooth objects darken themselves where cones start inside their own voxels: raise voxels.",
        quick: false,
        run: spheres,
    },
    Case {
        name: "self-light-plane",
        meaning: "A tilted square that a sun lights, and nothing else: its indirect light, which is none, over its direct light.",
        unit: Unit::Share,
        ideal: 0.0,
        limit: 1e-3,
        advice: "Lit surfaces brighten themselves where cones start inside their own voxels: raise voxels, or use the method rays.",
        quick: true,
        run: planes,
    },
    Case {
        name: "mirror-room",
        meaning: "A room whose walls are mirrors, with a lamp and a block: mean of the image over the path tracer's of as many \
                  bounces.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.1,
        advice: "With cones and light propagation a mirror in a mirror shows what lies before it, the same to all sides: use the method rays, \
                 which follows as many mirrors as there are bounces.",
        quick: false,
        run: |cell| against_truth(cell, mirror_room(), |image, truth| sum(image) / sum(truth)),
    },
    Case {
        name: "corridor",
        meaning: "Eight metres of corridor lit at one end, with all bounces: mean of the image of its far half over the path \
                  tracer's of all light.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.1,
        advice: "Light that needs many bounces arrives weaker or stronger than it is: add lamps far from the only one. With rays it is noise \
                 of the voxels' few directions: raise rays.bounce and rays.passes.",
        quick: false,
        run: corridors,
    },
    Case {
        name: "outside",
        meaning: "A room of which the cube of grid.side covers the middle half of each side: mean of the image over the path tracer's.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.1,
        advice: "What is outside the grid sends no light: leave grid.side at auto, make it hold the scene, or use the method rays.",
        quick: false,
        run: outside,
    },
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
