//! What walls let through that they should not, or keep back that they should let through.

use glam::DVec3;

use super::{rel, sum};
use crate::Result;
use crate::chart::measure::same_depth;
use crate::layers::Aov;
use crate::measure::metrics;
use crate::measure::terms::{self, Subtract};
use crate::stability::case::{Case, Place, Sample, Unit};
use crate::stability::cell::Cell;
use crate::stability::scenes::{DARK, LIT, back_side, behind, divided, fenced, two_rooms, view};
use crate::stability::stage::{Stage, Studio};

const fn leak(name: &'static str, meaning: &'static str, quick: bool, run: fn(&Cell) -> Result<Vec<Sample>>) -> Case {
    let advice = "Raise voxels until walls are some voxels thick, thicken the walls, align them with the axes, or use the method rays.";
    Case { name, meaning, unit: Unit::Share, ideal: 0.0, limit: 1e-3, advice, quick, run }
}

pub const CASES: &[Case] = &[
    leak(
        "leak-sheet",
        "Two closed rooms, one lit, divided by a double-sided sheet without thickness: mean of the dark room's image over the lit \
         one's.",
        false,
        |cell| leaks(cell, 0.0),
    ),
    leak("leak-1/4", "The same, with a wall a quarter of a voxel thick.", false, |cell| leaks(cell, 0.25)),
    leak("leak-1/2", "The same, with a wall half a voxel thick.", true, |cell| leaks(cell, 0.5)),
    leak("leak-1", "The same, with a wall one voxel thick.", false, |cell| leaks(cell, 1.0)),
    leak("leak-2", "The same, with a wall two voxels thick.", false, |cell| leaks(cell, 2.0)),
    leak("leak-4", "The same, with a wall four voxels thick.", false, |cell| leaks(cell, 4.0)),
    Case {
        name: "back-side",
        meaning: "A wall a quarter of a voxel thick, red and lit in front, black behind, and white squares half a metre before \
                  and behind it: indirect light on the one behind over that on the one in front.",
        unit: Unit::Share,
        ideal: 0.0,
        limit: 1e-3,
        advice: "Do not rely on thin walls with a bright and a dark side; thicken them to two voxels, or use the method rays.",
        quick: true,
        run: back_sides,
    },
    Case {
        name: "fence",
        meaning: "Two rooms, one lit, divided by slats half a voxel wide with gaps as wide: mean of the dark room's image over \
                  the path tracer's.",
        unit: Unit::Ratio,
        ideal: 1.0,
        limit: 0.05,
        advice: "Fences, grilles and foliage below a voxel need the method rays, with more directions than nine, or a grid finer than their gaps.",
        quick: false,
        run: fence,
    },
];

fn leaks(cell: &Cell, voxels: f64) -> Result<Vec<Sample>> {
    let thick = voxels * two_rooms().0.voxel_m(&cell.settings);
    let mut studio = Studio::new(cell, divided(thick))?;
    let pose = studio.stage.pose();
    let sample = |place| {
        let lit = studio.shoot_as(place, &pose, view(LIT, [0.0; 3]))?;
        let dark = studio.shoot_as(place, &pose, view(DARK, [0.0; 3]))?;
        Ok(Sample::new(place, sum(dark.beauty()) / sum(lit.beauty()), dark.beauty().to_vec()))
    };
    cell.turned_places().iter().map(sample).collect()
}

fn back_sides(cell: &Cell) -> Result<Vec<Sample>> {
    let thick = 0.25 * back_side(0.0).voxel_m(&cell.settings);
    let mut studio = Studio::new(cell, back_side(thick))?;
    let pose = studio.stage.pose();
    let sample = |place| {
        let [back, front] = [true, false].map(|side| studio.shoot_as(place, &pose, behind(side)));
        let (back, front) = (back?, front?);
        let [b, f] = [&back, &front].map(|image| sum(image.get(Aov::Indirect).unwrap_or_default()));
        Ok(Sample::new(place, b / f, back.beauty().to_vec()))
    };
    cell.turned_places().iter().map(sample).collect()
}

fn fence(cell: &Cell) -> Result<Vec<Sample>> {
    let voxel_m = two_rooms().0.voxel_m(&cell.settings);
    against_truth(cell, fenced(0.5 * voxel_m), |image, truth| sum(image) / sum(truth))
}

/// A number of the image and the path tracer's, at turned places.
pub fn against_truth(
    cell: &Cell,
    stage: Stage,
    number: impl Fn(&[[f32; 3]], &[[f32; 3]]) -> f64,
) -> Result<Vec<Sample>> {
    against_truth_at(cell, stage, "", &cell.turned_places(), number)
}

/// The same at `places` of a scene which is called `name` among others, or nothing.
pub fn against_truth_at(
    cell: &Cell,
    stage: Stage,
    name: &str,
    places: &[Place],
    number: impl Fn(&[[f32; 3]], &[[f32; 3]]) -> f64,
) -> Result<Vec<Sample>> {
    let depth = same_depth(&stage.scene, &cell.settings);
    let film = cell.film(&stage, (&stage.pose(), &stage.view), depth, 0)?;
    let (truth, noise) = (film.layers(&[Aov::Direct, Aov::Diffuse]), film.noise());
    let subtract = Subtract::in_scene(&stage.scene);
    let terms_differ = !terms::changes(&cell.settings).is_empty();
    let equal = || Studio::with(cell, stage.clone(), terms::on_equal_terms(&cell.settings), DVec3::ZERO);
    let mut equal = terms_differ.then(equal).transpose()?;
    let mut studio = Studio::new(cell, stage)?;
    let sample = |place: &Place| {
        let image = studio.shoot(place)?;
        let on_equal_terms = equal.as_mut().map(|studio| studio.shoot(place)).transpose()?;
        let comparison = metrics::compare(on_equal_terms.as_ref().unwrap_or(&image), &truth, subtract);
        let diffuse = comparison.ok().and_then(|comparison| comparison.indirect_diffuse);
        let [image, truth] = [&image, &truth].map(|layers| layers.beauty().to_vec());
        let energy = sum(&image) / sum(&truth);
        let mut more = vec![("rel", rel(&image, &truth)), ("energy", energy), ("the reference's noise", noise)];
        more.extend(
            diffuse
                .iter()
                .flat_map(|m| [("rel, indirect on diffuse", m.rel), ("energy, indirect on diffuse", m.energy)]),
        );
        let number = number(&image, &truth);
        let words = if name.is_empty() { place.to_string() } else { format!("{name}: {place}") };
        Ok(Sample { more, truth: Some(truth), ..Sample::new(words, number, image) })
    };
    places.iter().map(sample).collect()
}
