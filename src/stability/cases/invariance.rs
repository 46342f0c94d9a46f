//! Changes that should change nothing.

use glam::{DAffine3, DMat3, DVec3};

use super::{rel, sum};
use crate::Result;
use crate::scene::LightKind;
use crate::stability::case::{Place, Run, Sample};
use crate::stability::cell::Cell;
use crate::stability::scenes::{BAD_TRIANGLES, room, with_bad_triangles};
use crate::stability::stage::{Stage, Studio};

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("symmetry", symmetry),
    ("symmetry-mean", symmetry_of_means),
    ("scale", scale),
    ("far-away", far_away),
    ("brightness", brightness),
    ("bad-triangles", bad_triangles),
];

/// Rotations and mirrors of the cube: what becomes of x, y and z.
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

type Pixels = Vec<[f32; 3]>;

/// The plain image, and those under the symmetries as if they were plain.
fn symmetric(cell: &Cell) -> Result<(Pixels, Vec<(&'static str, Pixels)>)> {
    let mut studio = Studio::new(cell, room())?;
    let (pose, view) = (studio.stage.pose(), studio.stage.view);
    let plain = studio.shoot_at(&DAffine3::IDENTITY, &pose, view)?.beauty().to_vec();
    let count = if cell.effort.places < SYMMETRIES.len() { 4 } else { SYMMETRIES.len() };
    let every = SYMMETRIES.iter().step_by(SYMMETRIES.len() / count);
    let images = every.map(|(axes, signs, words)| {
        let columns = [0, 1, 2].map(|i| DVec3::AXES[axes[i]] * signs[i]);
        let world = DAffine3::from_mat3(DMat3::from_cols(columns[0], columns[1], columns[2]));
        let image = studio.shoot_at(&world, &pose, view)?;
        let mut pixels = image.beauty().to_vec();
        if world.matrix3.determinant() < 0.0 {
            pixels.chunks_mut(image.width as usize).for_each(<[_]>::reverse);
        }
        Ok((*words, pixels))
    });
    Ok((plain, images.collect::<Result<_>>()?))
}

fn symmetry(cell: &Cell) -> Result<Vec<Sample>> {
    let (plain, images) = symmetric(cell)?;
    let sample = |(words, image): (&str, Pixels)| Sample {
        truth: Some(plain.clone()),
        ..Sample::new(words, rel(&image, &plain), image)
    };
    Ok(images.into_iter().map(sample).collect())
}

fn symmetry_of_means(cell: &Cell) -> Result<Vec<Sample>> {
    let (plain, images) = symmetric(cell)?;
    let sample = |(words, image): (&str, Pixels)| Sample {
        truth: Some(plain.clone()),
        ..Sample::new(words, (sum(&image) / sum(&plain) - 1.0).abs(), image)
    };
    Ok(images.into_iter().map(sample).collect())
}

/// The image of a stage at one place, on a device of its own.
fn image_of(cell: &Cell, stage: Stage, center: DVec3, place: &Place) -> Result<Pixels> {
    let mut studio = Studio::with(cell, stage, cell.settings.clone(), center)?;
    let world = DAffine3::from_translation(center) * place.world(studio.stage.voxel_m(&cell.settings));
    let (pose, view) = (studio.stage.pose(), studio.stage.view);
    Ok(studio.shoot_at(&world, &pose, view)?.beauty().to_vec())
}

/// A place in the grid where nothing lies on a voxel's border.
fn off_borders() -> Place {
    Place::all(2, false)[1]
}

fn scale(cell: &Cell) -> Result<Vec<Sample>> {
    let place = off_borders();
    let plain = image_of(cell, room(), DVec3::ZERO, &place)?;
    let factors: &[f64] =
        if cell.effort.places < 8 { &[1e-3, 1e4] } else { &[1e-3, 1e-2, 0.1, 3.0, 10.0, 1e2, 1e3, 1e4] };
    let sample = |factor: &f64| {
        let image = image_of(cell, scaled(&room(), *factor), DVec3::ZERO, &place)?;
        Ok(Sample { truth: Some(plain.clone()), ..Sample::new(format!("×{factor}"), rel(&image, &plain), image) })
    };
    factors.iter().map(sample).collect()
}

/// The same image from a scene of another size: irradiance at a point light's distance stays.
fn scaled(stage: &Stage, factor: f64) -> Stage {
    let mut stage = stage.clone();
    let scale = DAffine3::from_scale(DVec3::splat(factor));
    for node in &mut stage.scene.nodes {
        let local = node.local.matrix();
        node.local = crate::scene::Transform::Matrix(scale * local);
    }
    for light in &mut stage.scene.lights {
        light.radius *= factor as f32;
        if light.kind != LightKind::Directional {
            light.intensity *= (factor * factor) as f32;
        }
    }
    stage.view.eye *= factor;
    stage.reach *= factor;
    if let crate::scene::Projection::Perspective { near, .. } = &mut stage.view.projection {
        *near *= factor as f32;
    }
    stage
}

fn far_away(cell: &Cell) -> Result<Vec<Sample>> {
    let place = off_borders();
    let plain = image_of(cell, room(), DVec3::ZERO, &place)?;
    let ways = [DVec3::X, -DVec3::Y, DVec3::Z, DVec3::new(1.0, -0.7, 0.3)];
    let sample = |way: &DVec3| {
        let image = image_of(cell, room(), *way * 1e5, &place)?;
        Ok(Sample { truth: Some(plain.clone()), ..Sample::new(format!("along {way}"), rel(&image, &plain), image) })
    };
    ways.iter().take(cell.effort.places).map(sample).collect()
}

fn brightness(cell: &Cell) -> Result<Vec<Sample>> {
    let place = off_borders();
    let plain = image_of(cell, room(), DVec3::ZERO, &place)?;
    let factors: &[f32] =
        if cell.effort.places < 8 { &[1e-6, 1e6] } else { &[1e-6, 1e-4, 1e-2, 0.1, 10.0, 1e2, 1e4, 1e6] };
    let sample = |factor: &f32| {
        let mut stage = room();
        stage.scene.lights.iter_mut().for_each(|light| light.intensity *= *factor);
        let image: Vec<_> =
            image_of(cell, stage, DVec3::ZERO, &place)?.into_iter().map(|p| p.map(|v| v / factor)).collect();
        Ok(Sample { truth: Some(plain.clone()), ..Sample::new(format!("×{factor}"), rel(&image, &plain), image) })
    };
    factors.iter().map(sample).collect()
}

fn bad_triangles(cell: &Cell) -> Result<Vec<Sample>> {
    let places: Vec<Place> = cell.places().into_iter().take(3).collect();
    let mut plain = Studio::new(cell, room())?;
    let truths = places.iter().map(|place| Ok(plain.shoot(place)?.beauty().to_vec())).collect::<Result<Vec<_>>>()?;
    let mut samples = Vec::new();
    for kind in BAD_TRIANGLES {
        let mut bad = Studio::new(cell, with_bad_triangles(&room(), kind))?;
        for (place, truth) in places.iter().zip(&truths) {
            let image = bad.shoot(place)?.beauty().to_vec();
            let (words, number) = (format!("{kind}: {place}"), rel(&image, truth));
            samples.push(Sample { truth: Some(truth.clone()), ..Sample::new(words, number, image) });
        }
    }
    Ok(samples)
}
