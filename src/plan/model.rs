//! Predictions for combinations of rungs from measurements of single steps.
//!
//! A step on a ladder multiplies the time of each pass by a factor, so that steps which affect the same pass multiply:
//! half the pixels and half the rays take a quarter of the gathering time. Errors multiply too: over full sweeps of
//! four scenes, a factor per step predicts them to 2–9 % (root mean square), and a sum of squares, as for independent
//! causes, to 3–20 %. Measurements correct deviations, because a prediction starts from the nearest measured place.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::search::{Point, Reading};
use super::space::Space;

/// Changes of a pass below this share of the frame count as noise.
const NOISE: f64 = 0.03;

/// The effect of a step from one rung of a ladder to another.
#[derive(Clone)]
struct Step {
    /// For each pass a factor and additional milliseconds.
    passes: BTreeMap<String, (f64, f64)>,
    /// Factor of the error.
    error: f64,
    bytes: f64,
}

/// Predictions for one method's places.
pub struct Model<'a> {
    spaces: &'a [Space],
    /// Measured points of all methods, because a step with one is a first guess for another.
    points: Vec<&'a Point>,
    /// The model is for this point's method, and prefers pairs of measured places near it.
    near: &'a Point,
    /// Known steps by ladder, start and end.
    steps: RefCell<HashMap<[usize; 3], Option<Step>>>,
}

impl<'a> Model<'a> {
    pub fn new(spaces: &'a [Space], points: &'a [Point], near: &'a Point) -> Self {
        Self { spaces, points: points.iter().filter(|point| point.ran()).collect(), near, steps: RefCell::default() }
    }

    /// Whether the step of a ladder was measured, with any rungs of the other ladders.
    pub fn knows(&self, ladder: usize, from: usize, to: usize) -> bool {
        self.measured(ladder, from, to).is_some()
    }

    /// Predicts the measurement of a place; `None` if a step to it is unknown.
    pub fn predict(&self, place: &[usize]) -> Option<Reading> {
        let distance = |point: &&&Point| differing(&point.place, place).count();
        let nearest = self.points.iter().filter(|point| point.space == self.near.space).min_by_key(distance)?;
        let Reading { mut passes, mut error, .. } = nearest.reading.clone();
        let mut bytes = nearest.reading.bytes as f64;
        for ladder in differing(&nearest.place, place) {
            let step = self.step(ladder, nearest.place[ladder], place[ladder])?;
            for (name, (factor, more)) in step.passes {
                let ms = passes.entry(name).or_default();
                *ms = *ms * factor + more;
            }
            (error, bytes) = (error * step.error, bytes + step.bytes);
        }
        Some(Reading { ms: passes.values().sum(), passes, bytes: bytes.max(0.0) as u64, error })
    }

    fn step(&self, ladder: usize, from: usize, to: usize) -> Option<Step> {
        let known = self.steps.borrow().get(&[ladder, from, to]).cloned();
        known.unwrap_or_else(|| {
            let step = self.find_step(ladder, from, to);
            self.steps.borrow_mut().insert([ladder, from, to], step.clone());
            step
        })
    }

    /// The step from one rung to another, composed of the steps between.
    fn find_step(&self, ladder: usize, from: usize, to: usize) -> Option<Step> {
        if let Some(step) = self.measured(ladder, from, to) {
            return Some(step);
        }
        let next = if to > from { from + 1 } else { from - 1 };
        if next == to {
            // The prediction is the previous step in the same direction.
            let before = if to > from { from.checked_sub(1)? } else { from + 1 };
            let mut like = self.measured(ladder, before, from)?;
            // Increases have diminishing effects, and decreases have growing ones.
            like.error = like.error.powf(if like.error < 1.0 { 0.5 } else { 1.5 });
            return Some(like);
        }
        Some(self.step(ladder, from, next)?.then(self.step(ladder, next, to)?))
    }

    /// The effect of a step from a pair of measured places that differ only in this ladder; pairs of other methods
    /// count last.
    fn measured(&self, ladder: usize, from: usize, to: usize) -> Option<Step> {
        let mut best: Option<(usize, &Point, &Point)> = None;
        let key = self.spaces[self.near.space].ladders[ladder].key;
        for (space, of) in self.spaces.iter().enumerate() {
            let Some(ladder) = of.ladders.iter().position(|ladder| ladder.key == key) else { continue };
            let on = |rung| self.points.iter().filter(move |point| point.space == space && point.place[ladder] == rung);
            for a in on(from) {
                let own = space == self.near.space;
                let far = if own { differing(&a.place, &self.near.place).count() } else { usize::MAX - 1 };
                for b in on(to) {
                    let nearer = best.is_none_or(|(least, ..)| far < least);
                    if nearer && differing(&a.place, &b.place).count() == 1 {
                        best = Some((far, a, b));
                    }
                }
            }
        }
        best.map(|(_, a, b)| Step::between(&a.reading, &b.reading))
    }
}

/// The ladders in which two places differ.
pub fn differing<'a>(a: &'a [usize], b: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
    a.iter().zip(b).enumerate().filter(|(_, (a, b))| a != b).map(|(ladder, _)| ladder)
}

impl Step {
    fn between(a: &Reading, b: &Reading) -> Self {
        let ms = |of: &Reading, name: &str| of.passes.get(name).copied().unwrap_or_default();
        let names: BTreeSet<&String> = a.passes.keys().chain(b.passes.keys()).collect();
        let passes = names.into_iter().filter_map(|name| {
            let (before, after) = (ms(a, name), ms(b, name));
            let change = if before > 0.0 { (after / before, 0.0) } else { (1.0, after) };
            ((after - before).abs() >= NOISE * a.ms).then(|| (name.clone(), change))
        });
        Self { passes: passes.collect(), error: b.error / a.error, bytes: b.bytes as f64 - a.bytes as f64 }
    }

    fn then(mut self, next: Self) -> Self {
        for (name, (factor, more)) in next.passes {
            let pass = self.passes.entry(name).or_insert((1.0, 0.0));
            *pass = (pass.0 * factor, pass.1 * factor + more);
        }
        Self { error: self.error * next.error, bytes: self.bytes + next.bytes, ..self }
    }
}
