//! Cases with a known amount of light: in simple scenes, with many or bright lamps, and in random scenes.

use glam::DVec3;

use super::walls::against_truth;
use super::{Run, Shown, at_places, energy, of_all, rel, sum};
use crate::Result;
use crate::chart::measure::same_depth;
use crate::layers::{Aov, Layers};
use crate::reference::Depth;
use crate::settings::{Bounces, LampLight};
use crate::stability::case::{Place, Sample};
use crate::stability::cell::Cell;
use crate::stability::random;
use crate::stability::scenes::{
    ROOM, STANDING, add_lamp, at, corridor, furnace, lit_square, mirror_room, room, room_with, sphere, standing,
    thousand_lamps,
};
use crate::stability::stage::CaseRenderer;

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("furnace-0.5", |cell| furnaces(cell, 0.5)),
    ("furnace-0.8", |cell| furnaces(cell, 0.8)),
    ("furnace-all", |cell| furnaces(&cell.with("bounces=all")?, 0.5)),
    ("self-light-sphere", spheres),
    ("self-light-plane", planes),
    ("mirror-room", |cell| against_truth(cell, mirror_room(), energy)),
    ("corridor", |cell| corridors(&cell.with("bounces=all")?)),
    ("outside", |cell| against_truth(&cell.with(&format!("grid.side={ROOM}"))?, room(), energy)),
    ("thousand-lamps", |cell| against_truth(cell, thousand_lamps(), rel)),
    ("bright-lamp", |cell| against_truth(cell, room_with(|scene| add_lamp(scene, 1e6, 0.004, at(0.1, 0.9, 0.1))), rel)),
    ("contact", contacts),
    ("random", random_scenes),
];

/// The light on a floor within three pixels of an object on it, over the path tracer's.
fn contacts(cell: &Cell) -> Result<Vec<Sample>> {
    of_all(&STANDING, |kind| {
        let stage = standing(kind);
        let view = stage.view;
        let film = cell.film(&stage, &stage.pose(), same_depth(&stage.scene, &cell.settings), 0)?;
        let truth = film.layers(&[Aov::Direct]);
        at_places(cell, stage, |studio, place| {
            let image = studio.shoot(place)?;
            let places = Shown { image: &image, view };
            let on_floor = |i: usize| places.place(i).is_some_and(|at| (at.y + ROOM).abs() < 1e-3);
            // Walls and the ceiling are farther away.
            let on_thing = |i: usize| {
                let inside = |at: DVec3| at.x.abs().max(at.z.abs()) < 0.98 && at.y < 0.65 - ROOM;
                !on_floor(i) && places.place(i).is_some_and(inside)
            };
            let strip: Vec<usize> =
                (0..image.beauty().len()).filter(|&i| on_floor(i) && places.about(i, 3).any(on_thing)).collect();
            let of = |pixels: &[[f32; 3]]| strip.iter().map(|&i| pixels[i]).collect::<Vec<_>>();
            let indirect =
                |image: &Layers| sum(&of(image.beauty())) - sum(&of(image.get(Aov::Direct).unwrap_or_default()));
            let (found, expected) = (of(image.beauty()), of(truth.beauty()));
            let more = vec![("rel", rel(&found, &expected)), ("energy, indirect", indirect(&image) / indirect(&truth))];
            let sample = Sample::new(format!("{kind}: {place}"), energy(&found, &expected), image.beauty());
            Ok(sample.with(more).beside(truth.beauty()))
        })
    })
}

fn furnaces(cell: &Cell, albedo: f32) -> Result<Vec<Sample>> {
    let (stage, albedo) = (furnace(albedo), f64::from(albedo));
    let ideal = match cell.settings.bounces {
        Bounces::All => 1.0 / (1.0 - albedo),
        // The total includes emission, its direct light, and the bounces. The first gather finds the direct light of
        // gathered lamps.
        finite => {
            let terms = finite.stored() + 2 - u32::from(cell.settings.lights.lamps == LampLight::Gathered);
            (0..terms).map(|k| albedo.powi(k as i32)).sum()
        }
    };
    at_places(cell, stage, |studio, place| {
        let image = studio.shoot_anew(place)?;
        let values = image.beauty().iter().flatten().map(|v| f64::from(*v) / ideal);
        let (least, most) = values.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
        let number = sum(image.beauty()) / (3 * image.beauty().len()) as f64 / ideal;
        Ok(Sample::new(place, number, image.beauty()).with(vec![("least pixel", least), ("brightest pixel", most)]))
    })
}

fn spheres(cell: &Cell) -> Result<Vec<Sample>> {
    at_places(cell, sphere(), |studio, place| {
        let image = studio.shoot(place)?;
        // Pixels at the sphere's outline also show the sky.
        let width = image.width as usize;
        let inside = |i: &usize| {
            let [x, y] = [i % width, i / width].map(|at| (at as f64 + 0.5) / width as f64 - 0.5);
            x.hypot(y) < 0.4
        };
        let pixels: Vec<[f32; 3]> = (0..width * width).filter(inside).map(|i| image.beauty()[i]).collect();
        Ok(Sample::new(place, sum(&pixels) / (3 * pixels.len()) as f64 / 0.5, image.beauty()))
    })
}

fn planes(cell: &Cell) -> Result<Vec<Sample>> {
    at_places(cell, lit_square(), |studio, place| {
        let image = studio.shoot(place)?;
        let [indirect, direct] = [Aov::Indirect, Aov::Direct].map(|aov| image.get(aov).unwrap_or_default());
        Ok(Sample::new(place, energy(indirect, direct), image.beauty()))
    })
}

fn corridors(cell: &Cell) -> Result<Vec<Sample>> {
    let stage = corridor();
    let truth = cell.film(&stage, &stage.pose(), Depth::Full, 0)?.layers(&[]);
    at_places(cell, stage, |studio, place| {
        let image = studio.shoot_anew(place)?;
        let (image, truth) = (image.beauty(), truth.beauty());
        Ok(Sample::new(place, energy(image, truth), image).beside(truth))
    })
}

fn random_scenes(cell: &Cell) -> Result<Vec<Sample>> {
    let place = Place::all(2, false)[1];
    let sample = |seed| {
        let stage = random::stage(seed);
        let (pose, depth) = (stage.pose(), same_depth(&stage.scene, &cell.settings));
        let film = |seed| Ok(cell.film(&stage, &pose, depth, seed)?.layers(&[]));
        let (a, b) = (film(0)?, film(1)?);
        let on_its_grid = Cell { settings: stage.with_its_grid(&cell.settings), ..cell.clone() };
        let image = CaseRenderer::new(&on_its_grid, stage)?.shoot(&place)?;
        let [image, a, b] = [&image, &a, &b].map(|layers| layers.beauty());
        let bound = random::bound(a);
        let [image_level, a_level, b_level] = [image, a, b].map(|pixels| random::level(pixels, bound));
        let truth = 0.5 * (a_level + b_level);
        let more = vec![("the reference's spread", (a_level - b_level).abs() / (2.0 * truth)), ("rel", rel(image, a))];
        Ok(Sample::new(format!("seed {seed}"), image_level / truth, image).with(more).beside(a))
    };
    (0..cell.effort.seeds).map(sample).collect()
}
