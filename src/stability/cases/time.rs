//! Cases with changes over time.

use glam::{DAffine3, DVec3, Vec3};

use super::{Run, at_places, energy};
use crate::Result;
use crate::chart::measure::same_depth;
use crate::layers::Layers;
use crate::measure::metrics;
use crate::measure::terms::Subtract;
use crate::scene::{LightKind, Pose, View};
use crate::stability::case::{Pixels, Place, Sample};
use crate::stability::cell::Cell;
use crate::stability::motion::{changes, excess, mean};
use crate::stability::scenes::{DOOR, add_lamp, at, doorway, room, room_with};
use crate::stability::stage::{CaseRenderer, Stage};

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("slide", slide),
    ("block", block),
    ("lamp-crossing", lamp),
    ("door", door),
    ("flicker", |cell| flicker(cell, false)),
    ("flicker-all", |cell| flicker(&cell.with("bounces=all")?, true)),
    ("turn", turn),
    ("light-on", |cell| step(&cell.with("bounces=all")?, 0.02, 1.0)),
    ("light-off", |cell| step(&cell.with("bounces=all")?, 1.0, 0.02)),
];

/// Steps of a motion, from 0 to the number of the effort.
fn along(cell: &Cell) -> impl Iterator<Item = f64> + use<> {
    (0..=cell.effort.steps).map(|step| step as f64)
}

/// The temporal excess of frames over their references. `more` are further numbers.
fn sample_of(place: &Place, frames: &[Layers], truths: &[Layers], more: &[(&'static str, f64)]) -> Result<Sample> {
    let (excess, worst) = excess(frames, truths)?;
    let flip = |(frame, truth)| Ok(metrics::compare(frame, truth, Subtract::Own)?.flip);
    let flips: Vec<f64> = frames.iter().zip(truths).map(flip).collect::<Result<_>>()?;
    let flip = flips.iter().sum::<f64>() / flips.len() as f64;
    let mut all = vec![("worst 1 % of pixels", worst), ("FLIP of a frame", flip)];
    // The number is absent if the reference does not change.
    let should = changes(truths);
    all.extend((should > 0.0).then(|| ("change over the reference's", changes(frames) / should)));
    all.extend(more);
    let last = |images: &[Layers]| images.last().map(|image| image.beauty().to_vec()).unwrap_or_default();
    Ok(Sample::new(place, excess, &last(frames)).with(all).beside(&last(truths)))
}

fn slide(cell: &Cell) -> Result<Vec<Sample>> {
    at_places(cell, room(), |studio, place| {
        let voxel_m = studio.stage.voxel_m(&cell.settings);
        let way = DVec3::new(1.0, 0.37, -0.61) * (voxel_m / 8.0);
        let frame = |step| studio.shoot_at(&(DAffine3::from_translation(way * step) * place.world(voxel_m)));
        let frames = along(cell).map(frame).collect::<Result<Vec<_>>>()?;
        sample_of(place, &frames, &vec![frames[0].clone(); frames.len()], &[])
    })
}

/// A motion compared with the path tracer; `pose` gives the pose of each step.
fn motion(cell: &Cell, stage: Stage, pose: impl Fn(f64) -> Pose) -> Result<Vec<Sample>> {
    let (truths, noise) = truths(cell, &stage, &pose)?;
    at_places(cell, stage, |studio, place| {
        let view = studio.stage.view;
        let frames = along(cell).map(|step| studio.shoot_as(place, &pose(step), view)).collect::<Result<Vec<_>>>()?;
        sample_of(place, &frames, &truths, &[("the reference's noise", noise)])
    })
}

/// Path-traced frames, and the excess due to their own noise. Each is the mean of two images with different seeds, so
/// half their difference has the distribution of the error. Each seed gives all frames the same random numbers, so that
/// unchanged parts have unchanged noise.
fn truths(cell: &Cell, stage: &Stage, pose: &impl Fn(f64) -> Pose) -> Result<(Vec<Layers>, f64)> {
    let depth = same_depth(&stage.scene, &cell.settings);
    let series = |seed| {
        let film = |step| cell.film(stage, &pose(step), depth, seed);
        along(cell).map(|step| Ok(film(step)?.layers(&[]))).collect::<Result<Vec<Layers>>>()
    };
    let (a, b) = (series(0)?, series(1)?);
    let noise = 0.5 * excess(&a, &b)?.0;
    Ok((a.iter().zip(&b).map(|(a, b)| mean(a, b)).collect(), noise))
}

/// The pose with one instance moved.
fn with_moved(stage: &Stage, instance: usize, by: DVec3) -> Pose {
    let mut pose = stage.pose();
    let place = &mut pose.world_from_instance[instance];
    *place = DAffine3::from_translation(by) * *place;
    pose
}

fn block(cell: &Cell) -> Result<Vec<Sample>> {
    let stage = room();
    let step_m = stage.voxel_m(&cell.settings) / 8.0;
    motion(cell, stage.clone(), |step| with_moved(&stage, 1, DVec3::NEG_X * step * step_m))
}

fn lamp(cell: &Cell) -> Result<Vec<Sample>> {
    let mut lamp = 0;
    let stage = room_with(|scene| lamp = add_lamp(scene, 20.0, 0.2, at(-0.1, 0.9, 0.05)));
    let step_m = stage.voxel_m(&cell.settings) / 8.0;
    motion(cell, stage.clone(), |step| with_moved(&stage, lamp, DVec3::X * step * step_m))
}

fn door(cell: &Cell) -> Result<Vec<Sample>> {
    let stage = doorway(0.005);
    let door = stage.scene.instances.len() - 1;
    // The view is from beside the doorway.
    let (open, steps) = (2.0 * f64::from(DOOR[1]) + 0.04, cell.effort.steps as f64);
    motion(cell, stage.clone(), |step| with_moved(&stage, door, DVec3::Z * open * (1.0 - step / steps)))
}

/// The share of pixels that differ in any bit.
fn changed(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let differ = |(a, b): &(&[f32; 3], &[f32; 3])| a.map(f32::to_bits) != b.map(f32::to_bits);
    a.iter().zip(b).filter(differ).count() as f64 / a.len() as f64
}

fn flicker(cell: &Cell, all: bool) -> Result<Vec<Sample>> {
    at_places(cell, room(), |studio, place| {
        let first = studio.shoot_anew(place)?;
        let mut worst = 0.0f64;
        for frame in 0..4 {
            // With feedback, rebuilt light continues from its earlier state.
            if frame >= 2 && !all {
                studio.renderer.make_anew();
            }
            worst = worst.max(changed(studio.shoot(place)?.beauty(), first.beauty()));
        }
        Ok(Sample::new(place, worst, first.beauty()))
    })
}

fn turn(cell: &Cell) -> Result<Vec<Sample>> {
    at_places(cell, room(), |studio, place| {
        let (pose, view) = (studio.stage.pose(), studio.stage.view);
        let first = studio.shoot(place)?;
        for degrees in [10.0f64, 25.0, 60.0, 20.0] {
            let turn = DAffine3::from_axis_angle(view.up, degrees.to_radians());
            studio.shoot_as(place, &pose, View { forward: turn.transform_vector3(view.forward), ..view })?;
        }
        let (first, last) = (first.beauty(), studio.shoot(place)?);
        Ok(Sample::new(place, changed(last.beauty(), first), last.beauty()).beside(first))
    })
}

/// The maximum number of frames after a step.
const MOST_FRAMES: usize = 24;

/// A light that changes from one brightness to another.
fn step(cell: &Cell, before: f32, after: f32) -> Result<Vec<Sample>> {
    let lit = |brightness: f32| {
        room_with(|scene| scene.add_light(LightKind::Point, Vec3::splat(2.0 * brightness), at(0.2, 0.6, 0.1)))
    };
    let mut studio = CaseRenderer::new(cell, lit(after))?;
    let sample = |place: &Place| {
        // Static light is finally the mean of many passes, and changing light is from one pass: each is compared with
        // its like.
        let mut follow = |first: f32| {
            let pose = studio.stage.pose();
            studio.renderer.change_scene(lit(first).scene, &pose, &[])?;
            let still = studio.shoot_anew(place)?.beauty().to_vec();
            studio.renderer.change_scene(lit(after).scene, &pose, &[])?;
            let images = (0..MOST_FRAMES).map(|_| Ok(studio.shoot(place)?.beauty().to_vec()));
            Ok((still, images.collect::<Result<Vec<_>>>()?))
        };
        let (still, always) = follow(after)?;
        let truth = &always[MOST_FRAMES - 1];
        let (_, images) = follow(before)?;
        let settled = |image: &Pixels| (energy(image, truth) - 1.0).abs() <= 0.01;
        let number = images.iter().rposition(|image| !settled(image)).map_or(1, |last| last + 2);
        let more = vec![
            ("first frame over settled", energy(&images[0], truth)),
            ("settled over still", energy(truth, &still)),
        ];
        Ok(Sample::new(place, number as f64, &images[0]).with(more).beside(truth))
    };
    Place::all(cell.effort.places, false).iter().take(3).map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_compared() {
        assert_eq!(changed(&[[0.0; 3]; 4], &[[0.0; 3], [0.0; 3], [-0.0; 3], [1.0; 3]]), 0.5);
    }
}
