//! Cases of walls and gaps: light that passes where it should not, or is blocked where it should pass.

use super::{Run, Shown, at_places, energy, of_all, rel, sum};
use crate::Result;
use crate::chart::measure::same_depth;
use crate::layers::{Aov, Layers};
use crate::measure::metrics;
use crate::measure::terms::{self, Subtract};
use crate::measure::timing::Spread;
use crate::scene::View;
use crate::stability::case::{Place, Sample};
use crate::stability::cell::Cell;
use crate::stability::scenes::{
    DARK, LIT, back_side, behind, divided, doorway, fenced, on_edge, roof, two_rooms, view, views_of_roof,
    views_on_edge,
};
use crate::stability::stage::{CaseRenderer, Stage};

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("leak-sheet", |cell| leaks(cell, 0.0)),
    ("leak-1/4", |cell| leaks(cell, 0.25)),
    ("leak-1/2", |cell| leaks(cell, 0.5)),
    ("leak-1", |cell| leaks(cell, 1.0)),
    ("leak-2", |cell| leaks(cell, 2.0)),
    ("leak-4", |cell| leaks(cell, 4.0)),
    ("leak-on-edge", |cell| {
        let stage = on_edge(0.25 * on_edge(0.0).voxel_m(&cell.settings));
        leaks_across(cell, &stage, &views_on_edge())
    }),
    ("leak-crease", |cell| of_all(&[0.26, 0.52, 0.79], |slope| leaks_across(cell, &roof(*slope), &views_of_roof()))),
    ("leak-door", leaks_at_a_door),
    ("back-side", back_sides),
    ("fence", |cell| {
        let voxel_m = two_rooms().0.voxel_m(&cell.settings);
        against_truth(cell, fenced(0.5 * voxel_m), energy)
    }),
];

fn leaks(cell: &Cell, voxels: f64) -> Result<Vec<Sample>> {
    let thick = voxels * two_rooms().0.voxel_m(&cell.settings);
    leaks_in(cell, divided(thick), |dark, lit| energy(dark.beauty(), lit.beauty()))
}

/// A number of the images of the dark room and of the lit one.
fn leaks_in(cell: &Cell, stage: Stage, number: impl Fn(&Layers, &Layers) -> f64) -> Result<Vec<Sample>> {
    at_places(cell, stage, |studio, place| {
        let pose = studio.stage.pose();
        let lit = studio.shoot_as(place, &pose, view(LIT, [0.0; 3]))?;
        let dark = studio.shoot_as(place, &pose, view(DARK, [0.0; 3]))?;
        Ok(Sample::new(place, number(&dark, &lit), dark.beauty()))
    })
}

/// The brightest of a pixel's channels.
fn brightest(image: &Layers, pixel: usize) -> f64 {
    f64::from(image.beauty()[pixel].into_iter().fold(0.0, f32::max))
}

/// The brightest pixel that shows the stage's dark half, x > 0, without a neighbour that shows the lit half, over the
/// median of the lit half.
fn leaks_across(cell: &Cell, stage: &Stage, views: &[View]) -> Result<Vec<Sample>> {
    of_all(views, |view| {
        at_places(cell, Stage { view: *view, ..stage.clone() }, |studio, place| {
            let image = studio.shoot(place)?;
            let places = Shown { image: &image, view: *view };
            let across = |i: usize| places.place(i).map(|at| at.x);
            let bright = |i: usize| brightest(&image, i);
            let pixels = 0..image.beauty().len();
            let is_lit = |i: usize| across(i).is_some_and(|x| x < 0.0);
            // The lamp itself may be visible, hence the median.
            let lit = Spread::of_values(pixels.clone().filter(|&i| is_lit(i)).map(bright));
            let dark = pixels.filter(|&i| across(i).is_some() && !places.about(i, 1).any(is_lit)).map(bright);
            let number = dark.fold(0.0, f64::max) / lit.median;
            Ok(Sample::new(format!("{place}, eye at {}", view.eye), number, image.beauty()))
        })
    })
}

/// The brightest pixel of the dark room behind a closed door, over the median of the lit room.
fn leaks_at_a_door(cell: &Cell) -> Result<Vec<Sample>> {
    leaks_in(cell, doorway(0.0), |dark, lit| {
        let of = |image: &Layers| Spread::of_values((0..image.beauty().len()).map(|i| brightest(image, i)));
        of(dark).max / of(lit).median
    })
}

fn back_sides(cell: &Cell) -> Result<Vec<Sample>> {
    let thick = 0.25 * back_side(0.0).voxel_m(&cell.settings);
    at_places(cell, back_side(thick), |studio, place| {
        let pose = studio.stage.pose();
        let [back, front] = [true, false].map(|side| studio.shoot_as(place, &pose, behind(side)));
        let (back, front) = (back?, front?);
        let [b, f] = [&back, &front].map(|image| sum(image.get(Aov::Indirect).unwrap_or_default()));
        Ok(Sample::new(place, b / f, back.beauty()))
    })
}

/// A number computed from the image and the path tracer's, at rotated places.
pub fn against_truth(
    cell: &Cell,
    stage: Stage,
    number: impl Fn(&[[f32; 3]], &[[f32; 3]]) -> f64,
) -> Result<Vec<Sample>> {
    against_truth_at(cell, stage, "", &cell.turned_places(), number)
}

/// As [`against_truth`], at `places` of a scene. `name` distinguishes it from other scenes of the case, or is empty.
pub fn against_truth_at(
    cell: &Cell,
    stage: Stage,
    name: &str,
    places: &[Place],
    number: impl Fn(&[[f32; 3]], &[[f32; 3]]) -> f64,
) -> Result<Vec<Sample>> {
    let film = cell.film(&stage, &stage.pose(), same_depth(&stage.scene, &cell.settings), 0)?;
    let (truth, noise) = (film.layers(&[Aov::Direct, Aov::Diffuse]), film.noise());
    let subtract = Subtract::in_scene(&stage.scene);
    let terms_differ = !terms::changes(&cell.settings).is_empty();
    let equal = Cell { settings: terms::on_equal_terms(&cell.settings), ..cell.clone() };
    let mut equal = terms_differ.then(|| CaseRenderer::new(&equal, stage.clone())).transpose()?;
    let mut studio = CaseRenderer::new(cell, stage)?;
    let sample = |place: &Place| {
        let image = studio.shoot(place)?;
        let on_equal_terms = equal.as_mut().map(|studio| studio.shoot(place)).transpose()?;
        let comparison = metrics::compare(on_equal_terms.as_ref().unwrap_or(&image), &truth, subtract);
        let diffuse = comparison.ok().and_then(|comparison| comparison.indirect_diffuse);
        let (image, truth) = (image.beauty(), truth.beauty());
        let mut more =
            vec![("rel", rel(image, truth)), ("energy", energy(image, truth)), ("the reference's noise", noise)];
        if let Some(m) = diffuse {
            more.extend([("rel, indirect on diffuse", m.rel), ("energy, indirect on diffuse", m.energy)]);
        }
        let words = if name.is_empty() { place.to_string() } else { format!("{name}: {place}") };
        Ok(Sample::new(words, number(image, truth), image).with(more).beside(truth))
    };
    places.iter().map(sample).collect()
}
