//! All cases.

mod fine;
mod invariance;
mod light;
mod time;
mod walls;

use std::sync::LazyLock;

use glam::DVec3;
use serde::Deserialize;

use super::case::{Case, Place, Sample};
use super::cell::Cell;
use super::stage::{CaseRenderer, Stage};
use crate::Result;
use crate::layers::{Aov, Layers};
use crate::measure::metrics::{self, NonFinite};
use crate::scene::View;

/// The function of a case: a sample for each place.
type Run = fn(&Cell) -> Result<Vec<Sample>>;

/// The functions of all cases.
fn runs() -> impl Iterator<Item = &'static (&'static str, Run)> {
    [walls::RUNS, light::RUNS, fine::RUNS, invariance::RUNS, time::RUNS].into_iter().flatten()
}

/// Every case, in the order of the page.
pub fn all() -> impl Iterator<Item = &'static Case> {
    #[derive(Deserialize)]
    struct Cases {
        case: Vec<Case>,
    }
    static ALL: LazyLock<Cases> =
        LazyLock::new(|| toml::from_str(include_str!("../cases.toml")).expect("a test reads the file"));
    ALL.case.iter()
}

/// The case called `name`.
pub fn named(name: &str) -> Option<&'static Case> {
    all().find(|case| case.name == name)
}

impl Case {
    /// A sample for each place.
    ///
    /// # Errors
    /// The reason why it could not run.
    pub fn run(&self, cell: &Cell) -> Result<Vec<Sample>> {
        let (_, run) = runs().find(|(name, _)| *name == self.name).expect("a test finds every case's function");
        run(cell)
    }
}

/// A sample of a stage at each of the turned places.
fn at_places(
    cell: &Cell,
    stage: Stage,
    sample: impl Fn(&mut CaseRenderer, &Place) -> Result<Sample>,
) -> Result<Vec<Sample>> {
    let mut studio = CaseRenderer::new(cell, stage)?;
    cell.turned_places().iter().map(|place| sample(&mut studio, place)).collect()
}

/// The samples of several scenes of a case, one after the other.
fn of_all<T>(scenes: &[T], samples: impl FnMut(&T) -> Result<Vec<Sample>>) -> Result<Vec<Sample>> {
    Ok(scenes.iter().map(samples).collect::<Result<Vec<_>>>()?.concat())
}

/// An image with the layer of depth, and its view.
struct Shown<'a> {
    image: &'a Layers,
    view: View,
}

impl Shown<'_> {
    /// The point of the scene at the middle of a pixel, with the scene centred at the origin; `None` without a surface.
    fn place(&self, pixel: usize) -> Option<DVec3> {
        let depth = self.image.get(Aov::Depth)?[pixel][0];
        self.view.surface(pixel, (self.image.width, self.image.height), depth)
    }

    /// The pixels within `reach` of a pixel along both axes, including itself.
    fn about(&self, pixel: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = [self.image.width, self.image.height].map(|side| side as usize);
        let near = move |at: usize, side: usize| at.saturating_sub(reach)..(at + reach + 1).min(side);
        near(pixel / width, height).flat_map(move |y| near(pixel % width, width).map(move |x| y * width + x))
    }
}

/// The sum over a layer's pixels and channels.
fn sum(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|v| f64::from(*v)).sum()
}

/// The light of an image over that of another.
fn energy(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    sum(image) / sum(reference)
}

/// The `rel` of [`metrics::metrics`]; NaN for an image with non-finite values, or with a black reference.
fn rel(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    match metrics::metrics(image, reference, "reference") {
        Ok(metrics) if NonFinite::of_pixels(image).count() == 0 => metrics.rel,
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_case_has_a_name_of_its_own_and_says_what_to_do() {
        let names: BTreeSet<&str> = all().map(|case| case.name.as_str()).collect();
        assert_eq!(names.len(), all().count());
        assert_eq!(names, runs().map(|(name, _)| *name).collect(), "functions without a case");
        for case in all() {
            let sentences = [&case.meaning, &case.advice];
            assert!(sentences.iter().all(|s| s.len() > 30 && s.ends_with('.')), "{}", case.name);
            assert!(case.limit >= 0.0 && case.ideal.is_finite(), "{}", case.name);
        }
    }

    #[test]
    fn differences_are_over_the_mean() {
        assert_eq!(rel(&[[2.0, 1.0, 1.0]], &[[1.0; 3]]), 1.0 / 3.0);
        assert!(rel(&[[f32::NAN; 3], [1.0; 3]], &[[1.0; 3]; 2]).is_nan());
    }
}
