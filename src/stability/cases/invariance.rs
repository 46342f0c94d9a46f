//! Cases with changes that must not affect the image.

use glam::{DAffine3, DMat3, DVec3};

use super::{Run, energy, of_all, rel};
use crate::Result;
use crate::layers::Layers;
use crate::scene::{LightKind, Projection, Transform};
use crate::stability::case::{Pixels, Place, Sample};
use crate::stability::cell::Cell;
use crate::stability::scenes::{BAD_TRIANGLES, room, with_bad_triangles};
use crate::stability::stage::{CaseRenderer, Stage};

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("symmetry", |cell| symmetry(cell, rel)),
    ("symmetry-mean", |cell| symmetry(cell, |image, plain| (energy(image, plain) - 1.0).abs())),
    ("scale", scale),
    ("far-away", far_away),
    ("brightness", brightness),
    ("bad-triangles", bad_triangles),
];

/// Rotations and reflections of the cube: the images of x, y and z.
const SYMMETRIES: [([usize; 3], [f64; 3], &str); 8] = [
    ([0, 2, 1], [1.0, -1.0, 1.0], "a quarter turn about x"),
    ([2, 1, 0], [1.0, 1.0, -1.0], "a quarter turn about y"),
    ([1, 0, 2], [-1.0, 1.0, 1.0], "a quarter turn about z"),
    ([0, 1, 2], [-1.0, 1.0, -1.0], "a half turn about y"),
    ([1, 2, 0], [1.0, 1.0, 1.0], "a third of a turn about the diagonal"),
    ([0, 1, 2], [-1.0, 1.0, 1.0], "mirrored in x"),
    ([0, 1, 2], [1.0, -1.0, 1.0], "mirrored in y"),
    ([1, 0, 2], [1.0, 1.0, 1.0], "x and y swapped"),
];

/// A number of the transformed-back images under the symmetries, compared with the original image.
fn symmetry(cell: &Cell, number: impl Fn(&[[f32; 3]], &[[f32; 3]]) -> f64) -> Result<Vec<Sample>> {
    let mut studio = CaseRenderer::new(cell, room())?;
    let plain = studio.shoot_at(&DAffine3::IDENTITY)?;
    let count = if cell.effort.places < SYMMETRIES.len() { 4 } else { SYMMETRIES.len() };
    let sample = |(axes, signs, words): &([usize; 3], [f64; 3], &str)| {
        let columns = [0, 1, 2].map(|i| DVec3::AXES[axes[i]] * signs[i]);
        let world = DAffine3::from_mat3(DMat3::from_cols(columns[0], columns[1], columns[2]));
        let mut pixels = studio.shoot_at(&world)?.beauty().to_vec();
        if world.matrix3.determinant() < 0.0 {
            pixels.chunks_mut(plain.width as usize).for_each(<[_]>::reverse);
        }
        Ok(Sample::new(words, number(&pixels, plain.beauty()), &pixels).beside(plain.beauty()))
    };
    SYMMETRIES.iter().step_by(SYMMETRIES.len() / count).map(sample).collect()
}

/// The image of a stage on a new device, at a place in the grid where nothing lies on a voxel's border.
fn image_of(cell: &Cell, stage: Stage, center: DVec3) -> Result<Pixels> {
    let mut studio = CaseRenderer::about(cell, stage, center)?;
    let place = Place::all(2, false)[1].world(studio.stage.voxel_m(&cell.settings));
    Ok(studio.shoot_at(&(DAffine3::from_translation(center) * place))?.beauty().to_vec())
}

/// Images of changes to the room, with the changes undone, and the original image. `image` renders a change and
/// describes it.
fn changes<T>(changes: &[T], cell: &Cell, image: impl Fn(&T) -> Result<(String, Pixels)>) -> Result<Vec<Sample>> {
    let plain = image_of(cell, room(), DVec3::ZERO)?;
    let sample = |change: &T| {
        let (words, image) = image(change)?;
        Ok(Sample::new(words, rel(&image, &plain), &image).beside(&plain))
    };
    changes.iter().map(sample).collect()
}

/// The whole list, or its first and last element for `--quick`.
fn extremes<T: Copy>(cell: &Cell, all: &[T]) -> Vec<T> {
    if cell.effort.places < 8 { vec![all[0], all[all.len() - 1]] } else { all.to_vec() }
}

fn scale(cell: &Cell) -> Result<Vec<Sample>> {
    let factors = extremes(cell, &[1e-3, 1e-2, 0.1, 3.0, 10.0, 1e2, 1e3, 1e4]);
    changes(&factors, cell, |factor| Ok((format!("×{factor}"), image_of(cell, scaled(room(), *factor), DVec3::ZERO)?)))
}

/// Scales a scene so that its image is unchanged: the irradiance from a point light stays equal.
fn scaled(mut stage: Stage, factor: f64) -> Stage {
    let scale = DAffine3::from_scale(DVec3::splat(factor));
    for node in &mut stage.scene.nodes {
        node.local = Transform::Matrix(scale * node.local.matrix());
    }
    for light in &mut stage.scene.lights {
        light.radius *= factor as f32;
        if light.kind != LightKind::Directional {
            light.intensity *= (factor * factor) as f32;
        }
    }
    stage.view.eye *= factor;
    stage.reach *= factor;
    if let Projection::Perspective { near, .. } = &mut stage.view.projection {
        *near *= factor as f32;
    }
    stage
}

fn far_away(cell: &Cell) -> Result<Vec<Sample>> {
    let ways = [DVec3::X, -DVec3::Y, DVec3::Z, DVec3::new(1.0, -0.7, 0.3)];
    let count = cell.effort.places.min(ways.len());
    changes(&ways[..count], cell, |way| Ok((format!("along {way}"), image_of(cell, room(), *way * 1e5)?)))
}

fn brightness(cell: &Cell) -> Result<Vec<Sample>> {
    let factors = extremes(cell, &[1e-6f32, 1e-4, 1e-2, 0.1, 10.0, 1e2, 1e4, 1e6]);
    changes(&factors, cell, |factor| {
        let mut stage = room();
        stage.scene.lights.iter_mut().for_each(|light| light.intensity *= *factor);
        let image = image_of(cell, stage, DVec3::ZERO)?;
        Ok((format!("×{factor}"), image.into_iter().map(|p| p.map(|v| v / factor)).collect()))
    })
}

fn bad_triangles(cell: &Cell) -> Result<Vec<Sample>> {
    let places: Vec<Place> = Place::all(cell.effort.places, false).into_iter().take(3).collect();
    let mut plain = CaseRenderer::new(cell, room())?;
    let truths = places.iter().map(|place| plain.shoot(place)).collect::<Result<Vec<_>>>()?;
    of_all(&BAD_TRIANGLES, |kind| {
        let mut bad = CaseRenderer::new(cell, with_bad_triangles(kind))?;
        let sample = |(place, truth): (&Place, &Layers)| {
            let (image, truth) = (bad.shoot(place)?, truth.beauty());
            let number = rel(image.beauty(), truth);
            Ok(Sample::new(format!("{kind}: {place}"), number, image.beauty()).beside(truth))
        };
        places.iter().zip(&truths).map(sample).collect()
    })
}
