//! Lamps, many or bright, and scenes made by chance.

use super::walls::against_truth;
use glam::DVec3;

use super::rel;
use crate::Result;
use crate::chart::measure::same_depth;
use crate::stability::case::{Place, Run, Sample};
use crate::stability::cell::Cell;
use crate::stability::random;
use crate::stability::scenes::{add_lamp, at, room_with, thousand_lamps};
use crate::stability::stage::Studio;

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("thousand-lamps", |cell| against_truth(cell, thousand_lamps(), rel)),
    ("bright-lamp", bright_lamp),
    ("random", random_scenes),
];

fn bright_lamp(cell: &Cell) -> Result<Vec<Sample>> {
    let stage = room_with(|scene| {
        add_lamp(scene, 1e6, 0.004, at(0.1, 0.9, 0.1));
    });
    against_truth(cell, stage, rel)
}

fn random_scenes(cell: &Cell) -> Result<Vec<Sample>> {
    let place = Place::all(2, false)[1];
    let sample = |seed| {
        let stage = random::stage(seed);
        let (pose, view) = (stage.pose(), stage.view);
        let depth = same_depth(&stage.scene, &cell.settings);
        let [a, b] =
            [0, 1].map(|seed| Ok(cell.film(&stage, (&pose, &view), depth, seed)?.layers(&[]).beauty().to_vec()));
        let (a, b): (Vec<[f32; 3]>, Vec<[f32; 3]>) = (a?, b?);
        let settings = stage.with_its_grid(&cell.settings);
        let image = Studio::with(cell, stage, settings, DVec3::ZERO)?.shoot(&place)?.beauty().to_vec();
        let bound = random::bound(&a);
        let [image_level, a_level, b_level] = [&image, &a, &b].map(|pixels| random::level(pixels, bound));
        let truth = 0.5 * (a_level + b_level);
        let more =
            vec![("the reference's spread", (a_level - b_level).abs() / (2.0 * truth)), ("rel", rel(&image, &a))];
        let words = format!("seed {seed}");
        Ok(Sample { more, truth: Some(a), ..Sample::new(words, image_level / truth, image) })
    };
    (0..cell.effort.seeds).map(sample).collect()
}
