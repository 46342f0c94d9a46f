//! Lamps, many or bright, and scenes made by chance.

use super::walls::against_truth;
use glam::DVec3;

use super::rel;
use crate::Result;
use crate::chart::measure::same_depth;
use crate::stability::case::{Case, Place, Sample, Unit};
use crate::stability::cell::Cell;
use crate::stability::random;
use crate::stability::scenes::{add_lamp, at, room_with, thousand_lamps};
use crate::stability::stage::Studio;

pub const CASES: &[Case] = &[
    Case {
        name: "thousand-lamps",
        meaning: "A room under 1024 lamps of 2 cm, which are not in view: mean |error| against the path tracer over its mean.",
        unit: Unit::Share,
        ideal: 0.0,
        limit: 0.1,
        advice: "Raise lights.lamp_points where many lamps make noise, or join them into larger ones.",
        quick: false,
        run: |cell| against_truth(cell, thousand_lamps(), rel),
    },
    Case {
        name: "bright-lamp",
        meaning: "A room lit by a lamp of 4 mm and a radiance of 10⁶: mean |error| against the path tracer over its mean.",
        unit: Unit::Share,
        ideal: 0.0,
        limit: 0.1,
        advice: "Replace lamps far smaller than a voxel by point lights, or keep lights.lamps at sampled. What `fast` is off \
                 falls to a third where every pixel gathers: raise image.gather_resolution.",
        quick: false,
        run: bright_lamp,
    },
    Case {
        name: "random",
        meaning: "Scenes made by chance, of boxes in boxes, slivers, triangles without area, tiny and huge parts, all materials and \
                  kinds of lights: mean of the image over the path tracer's of as many bounces. A thousandth of what a light of 1 \
                  gives is added to both, so that a black view shows leaks as they are seen; no value counts more than four times \
                  what 98 % of the truth's do not exceed, since lamps smaller than a pixel are met by chance.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.2,
        advice: "Compare your own scene with `twobounce reference`: the worst have the camera within glass, blended triangles through \
                 each other, lights that almost touch a surface, or mirrors in pieces. Of a thousand, 71 % are within 2 % at 32³, 86 % \
                 within 5 %, 94 % within 10 %; where nothing lets light through 82, 93, 99.",
        quick: false,
        run: random_scenes,
    },
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
