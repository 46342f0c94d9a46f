//! Lamps, many or bright, and scenes made by chance.

use super::walls::against_truth;
use super::{Run, rel};
use crate::Result;
use crate::chart::measure::same_depth;
use crate::stability::case::{Place, Sample};
use crate::stability::cell::Cell;
use crate::stability::random;
use crate::stability::scenes::{add_lamp, at, room_with, thousand_lamps};
use crate::stability::stage::Studio;

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("thousand-lamps", |cell| against_truth(cell, thousand_lamps(), rel)),
    ("bright-lamp", |cell| against_truth(cell, room_with(|scene| add_lamp(scene, 1e6, 0.004, at(0.1, 0.9, 0.1))), rel)),
    ("random", random_scenes),
];

fn random_scenes(cell: &Cell) -> Result<Vec<Sample>> {
    let place = Place::all(2, false)[1];
    let sample = |seed| {
        let stage = random::stage(seed);
        let (pose, depth) = (stage.pose(), same_depth(&stage.scene, &cell.settings));
        let film = |seed| Ok(cell.film(&stage, &pose, depth, seed)?.layers(&[]));
        let (a, b) = (film(0)?, film(1)?);
        let on_its_grid = Cell { settings: stage.with_its_grid(&cell.settings), ..cell.clone() };
        let image = Studio::new(&on_its_grid, stage)?.shoot(&place)?;
        let [image, a, b] = [&image, &a, &b].map(|layers| layers.beauty());
        let bound = random::bound(a);
        let [image_level, a_level, b_level] = [image, a, b].map(|pixels| random::level(pixels, bound));
        let truth = 0.5 * (a_level + b_level);
        let more = vec![("the reference's spread", (a_level - b_level).abs() / (2.0 * truth)), ("rel", rel(image, a))];
        Ok(Sample::new(format!("seed {seed}"), image_level / truth, image).with(more).beside(a))
    };
    (0..cell.effort.seeds).map(sample).collect()
}
