//! Cases with small or smooth details, and at the border of the grid.

use glam::DVec3;

use super::walls::against_truth_at;
use super::{Run, at_places, energy, of_all, rel, sum};
use crate::Result;
use crate::layers::Aov;
use crate::reference::Depth;
use crate::scene::{Projection, View};
use crate::stability::SIZE;
use crate::stability::case::{Pixels, Place, Sample};
use crate::stability::cell::Cell;
use crate::stability::fine_scenes::{
    BORDERS, GLASS, THIN, border_room, glass, glossy_floor, paper, slope, slope_radiance, thin_screen,
};
use crate::stability::stage::CaseRenderer;

/// The functions of the cases, by their names in `src/stability/cases.toml`.
pub const RUNS: &[(&str, Run)] = &[
    ("thin-block", |cell| thin(cell, false)),
    ("thin-send", |cell| thin(cell, true)),
    ("paper", |cell| against_truth_at(cell, paper(), "", &cell.turned_places(), rel)),
    ("banding", banding),
    ("lobe-width", lobe_width),
    ("refraction", refraction),
    ("edges", edges),
];

/// A few of the places, so that several scenes of a case take no longer than one of another.
fn few(cell: &Cell) -> Vec<Place> {
    cell.turned_places().into_iter().take(3).collect()
}

fn thin(cell: &Cell, sends: bool) -> Result<Vec<Sample>> {
    let voxel_m = thin_screen(THIN[0], 0.1, sends).voxel_m(&cell.settings);
    of_all(&THIN, |kind| against_truth_at(cell, thin_screen(kind, voxel_m, sends), kind, &few(cell), energy))
}

/// A layer's sums over the rows from `first` to `end` of the image, column by column.
fn columns(pixels: &[[f32; 3]], first: usize, end: usize) -> Vec<f64> {
    let width = SIZE as usize;
    (0..width).map(|x| (first..end).map(|y| sum(&pixels[y * width + x..=y * width + x])).sum()).collect()
}

/// Half the height that a view shows at a distance of 1.
fn tangent(view: &View) -> f64 {
    let Projection::Perspective { fov, .. } = view.projection else { unreachable!("the view is a perspective one") };
    f64::from(0.5 * fov).tan()
}

fn banding(cell: &Cell) -> Result<Vec<Sample>> {
    let stage = slope();
    let (view, size) = (stage.view, SIZE as usize);
    let at = |i: usize| (2.0 * (i as f64 + 0.5) / size as f64 - 1.0) * tangent(&view);
    let radiance = |i: usize| slope_radiance(&view, [at(i % size), -at(i / size)]) as f32;
    let truth: Pixels = (0..size * size).map(|i| [radiance(i); 3]).collect();
    let middle = |pixels: &[[f32; 3]]| columns(pixels, size / 4, 3 * size / 4);
    let should = middle(&truth);
    at_places(cell, stage, |studio, place| {
        let layers = studio.shoot(place)?;
        let image = layers.get(Aov::Indirect).unwrap_or_default();
        let ratio: Vec<f64> = middle(image).iter().zip(&should).map(|(a, b)| a / b).collect();
        let bend = ratio.windows(7).map(|r| (r[0] - 2.0 * r[3] + r[6]).abs()).fold(0.0, f64::max);
        Ok(Sample::new(place, bend, image).with(vec![("energy", energy(image, &truth))]).beside(&truth))
    })
}

/// The width of a step in columns; for a ramp it is two thirds of the ramp's width.
fn step_width(profile: &[f64]) -> f64 {
    let end = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (high, low) = (end(&profile[..4]), end(&profile[profile.len() - 4..]));
    let share = |value: &f64| ((value - low) / (high - low)).clamp(0.0, 1.0);
    profile.iter().map(share).map(|u| 4.0 * u * (1.0 - u)).sum()
}

fn lobe_width(cell: &Cell) -> Result<Vec<Sample>> {
    let size = SIZE as usize;
    // Noise makes an edge appear narrower.
    let smooth = |profile: Vec<f64>| profile.windows(4).map(|w| w.iter().sum::<f64>() / 4.0).collect::<Vec<_>>();
    let width = |pixels: &[[f32; 3]]| step_width(&smooth(columns(pixels, size / 2, 3 * size / 4)));
    // With roughness 1 the edge is wider than the image.
    of_all(&[0.1, 0.2, 0.3, 0.5, 0.7], |roughness| {
        let name = format!("roughness {roughness}");
        let places = &few(cell)[..2];
        against_truth_at(cell, glossy_floor(*roughness), &name, places, |image, truth| width(image) / width(truth))
    })
}

/// The mean of images with views shifted within a pixel, so that edges seen directly or through glass are filtered like
/// those of the path tracer.
fn filtered(studio: &mut CaseRenderer, place: &Place) -> Result<Pixels> {
    const SIDE: u32 = 4;
    let (pose, view) = (studio.stage.pose(), studio.stage.view);
    let pixel = 2.0 * tangent(&view) / f64::from(SIZE);
    let shift = |i: u32| ((f64::from(i) + 0.5) / f64::from(SIDE) - 0.5) * pixel;
    let mut mean = vec![[0.0f32; 3]; (SIZE * SIZE) as usize];
    for i in 0..SIDE * SIDE {
        let forward = (view.forward + view.right() * shift(i % SIDE) + view.up * shift(i / SIDE)).normalize();
        let image = studio.shoot_as(place, &pose, View { forward, ..view })?;
        for (sum, value) in mean.iter_mut().flatten().zip(image.beauty().iter().flatten()) {
            *sum += value / (SIDE * SIDE) as f32;
        }
    }
    Ok(mean)
}

fn refraction(cell: &Cell) -> Result<Vec<Sample>> {
    of_all(&GLASS, |(kind, ior)| {
        let stage = glass(kind, *ior);
        let truth = cell.film(&stage, &stage.pose(), Depth::Full, 0)?.layers(&[]);
        let truth = truth.beauty();
        let mut studio = CaseRenderer::new(cell, stage)?;
        let sample = |place: &Place| {
            let image = filtered(&mut studio, place)?;
            let more = vec![("energy", energy(&image, truth))];
            Ok(Sample::new(format!("{kind}: {place}"), rel(&image, truth), &image).with(more).beside(truth))
        };
        few(cell)[..2].iter().map(sample).collect()
    })
}

fn edges(cell: &Cell) -> Result<Vec<Sample>> {
    let without_margin = cell.with("grid.margin=0")?;
    of_all(&BORDERS, |kind| {
        let offset = DVec3::splat(if kind.ends_with("outside") { 0.25 } else { 0.0 });
        let place = Place { offset, degrees: 0.0 };
        let usual = sum(CaseRenderer::new(cell, border_room(kind))?.shoot(&place)?.beauty());
        against_truth_at(&without_margin, border_room(kind), kind, &[place], |image, _| sum(image) / usual)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wider_step_is_wider() {
        let ramp = |width: f64| -> Vec<f64> {
            (0..64).map(|x| (0.5 - (f64::from(x) - 31.5) / width).clamp(0.0, 1.0)).collect()
        };
        assert!((step_width(&ramp(12.0)) - 8.0).abs() < 0.1);
        assert!((step_width(&ramp(24.0)) / step_width(&ramp(12.0)) - 2.0).abs() < 0.02);
    }
}
