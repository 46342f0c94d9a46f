//! Chooses the order of measurements: presets first, then single steps from the best, then the most promising
//! combinations of these.

use std::collections::BTreeMap;

use super::limits::{Limits, Score};
use super::model::{Model, differing};
use super::space::{Ladder, Rungs, Space};
use crate::Result;

/// The result of one measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Device time of a frame in milliseconds.
    pub ms: f64,
    /// Device time of each pass in milliseconds.
    pub passes: BTreeMap<String, f64>,
    /// Device memory in bytes.
    pub bytes: u64,
    /// The error as in [`Limits::error`].
    pub error: f64,
}

/// A measured place.
#[derive(Clone, Debug)]
pub struct Point {
    /// Index of its space.
    pub space: usize,
    pub place: Rungs,
    pub reading: Reading,
}

impl Point {
    /// Whether the settings could run.
    pub fn ran(&self) -> bool {
        self.reading.error.is_finite() && self.reading.ms.is_finite()
    }
}

/// Measures the settings at a place of a space. Settings that cannot run have infinite time and error; an error ends
/// the search.
pub type Measure<'a> = dyn FnMut(usize, &[usize]) -> Result<Reading> + 'a;

/// The minimum predicted gain for measuring a combination.
const MIN_GAIN: f64 = 0.03;
/// The factor by which predicted time and error are reduced for each differing ladder, because predictions are off by
/// some percent.
const OPTIMISM_PER_STEP: f64 = 0.98;
/// The number of successive failed predictions after which the search ends.
const MAX_FAILED_PREDICTIONS: u32 = 6;
/// The maximum number of ladders in which a combination differs from the best, and of rungs on each.
const CHANGED: usize = 4;
const REACH: usize = 2;

pub struct Search<'a> {
    pub spaces: &'a [Space],
    pub limits: Limits,
    pub points: Vec<Point>,
    /// Whether the search ended because no measurement was promising.
    pub finished: bool,
}

impl<'a> Search<'a> {
    pub fn new(spaces: &'a [Space], limits: Limits) -> Self {
        Self { spaces, limits, points: Vec::new(), finished: false }
    }

    /// Measures until no measurement is promising.
    ///
    /// # Errors
    /// Errors of `measure`; the points are then those measured before.
    pub fn run(&mut self, measure: &mut Measure) -> Result<()> {
        self.finished = false;
        self.race(measure)?;
        // The best method comes first, because its steps are a first guess for the others.
        for space in self.order() {
            self.climb(space, measure)?;
        }
        self.finished = true;
        Ok(())
    }

    /// The best places in order: all, or those of one space.
    pub fn best(&self, space: Option<usize>) -> Vec<&Point> {
        let mut points: Vec<&Point> =
            self.points.iter().filter(|p| p.ran() && space.is_none_or(|s| s == p.space)).collect();
        points.sort_by(|a, b| self.score(a).compare(&self.score(b)));
        points
    }

    fn score(&self, point: &Point) -> Score {
        self.limits.score(&point.reading)
    }

    pub fn point(&self, space: usize, place: &[usize]) -> Option<&Point> {
        self.points.iter().find(|point| point.space == space && point.place == place)
    }

    /// The score of a place, which is measured if it is new.
    fn look(&mut self, space: usize, place: &Rungs, measure: &mut Measure) -> Result<Score> {
        if let Some(point) = self.point(space, place) {
            return Ok(self.score(point));
        }
        let point = Point { space, place: place.clone(), reading: measure(space, place)? };
        let score = self.score(&point);
        self.points.push(point);
        Ok(score)
    }

    /// Measures the starting places: first one of each method, then further ones of the best method, until one is not
    /// better.
    fn race(&mut self, measure: &mut Measure) -> Result<()> {
        let spaces = self.spaces;
        for (index, space) in spaces.iter().enumerate() {
            self.look(index, &space.starts[0], measure)?;
        }
        for index in self.order() {
            for pair in spaces[index].starts.windows(2) {
                let now = self.look(index, &pair[1], measure)?;
                if self.look(index, &pair[0], measure)? < now {
                    break;
                }
            }
        }
        Ok(())
    }

    /// The spaces, that of the best place first.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = Vec::new();
        for point in self.best(None) {
            if !order.contains(&point.space) {
                order.push(point.space);
            }
        }
        order
    }

    /// Improves a method from its best place.
    fn climb(&mut self, space: usize, measure: &mut Measure) -> Result<()> {
        let mut misses = 0;
        while let Some(best) = self.best(Some(space)).first().copied().cloned() {
            if let Some(step) = self.unknown_step(&best) {
                self.look(space, &step, measure)?;
                continue;
            }
            let Some(place) = self.promising(&best).filter(|_| misses < MAX_FAILED_PREDICTIONS) else { break };
            let kept = self.look(space, &place, measure)? < self.score(&best);
            misses = if kept { 0 } else { misses + 1 };
        }
        Ok(())
    }

    /// A neighbouring step whose effect is unknown, downward first.
    fn unknown_step(&self, from: &Point) -> Option<Rungs> {
        let model = Model::new(self.spaces, &self.points, from);
        let ladders = &self.spaces[from.space].ladders;
        let down = (0..ladders.len()).map(|ladder| (ladder, from.place[ladder].checked_sub(1)));
        let up = |ladder: usize| Some(from.place[ladder] + 1).filter(|rung| *rung < ladders[ladder].rungs.len());
        let steps = down.chain((0..ladders.len()).map(|ladder| (ladder, up(ladder))));
        let mut places = steps.filter_map(|(ladder, rung)| {
            let rung = rung.filter(|rung| !model.knows(ladder, from.place[ladder], *rung))?;
            Some(with_rung(&from.place, ladder, rung))
        });
        places.find(|place| self.point(from.space, place).is_none())
    }

    /// The unmeasured place near the best with the best prediction, if it is better than the best.
    fn promising(&self, best: &Point) -> Option<Rungs> {
        let model = Model::new(self.spaces, &self.points, best);
        let target = self.score(best);
        let promised = |place: Rungs| {
            let hope = OPTIMISM_PER_STEP.powi(differing(&best.place, &place).count() as i32);
            let reading = model.predict(&place)?;
            let hoped = Reading { ms: reading.ms * hope, error: reading.error * hope, ..reading };
            Some((self.limits.score(&hoped), place))
        };
        let about = about(&self.spaces[best.space].ladders, &best.place, 0, CHANGED);
        let new = about.into_iter().filter(|place| self.point(best.space, place).is_none());
        let better = new.filter_map(promised).filter(|(score, _)| score.beats(&target, MIN_GAIN));
        better.min_by(|a, b| a.0.compare(&b.0)).map(|(_, place)| place)
    }
}

/// A place with another rung of one ladder.
pub fn with_rung(place: &[usize], ladder: usize, rung: usize) -> Rungs {
    let mut place = place.to_vec();
    place[ladder] = rung;
    place
}

/// Every place that differs from this one in up to `most` ladders, starting with the ladder `first`, by a few rungs.
fn about(ladders: &[Ladder], place: &[usize], first: usize, most: usize) -> Vec<Rungs> {
    let mut places = Vec::new();
    for ladder in first..ladders.len() {
        let own = place[ladder];
        let near = own.saturating_sub(REACH)..(own + REACH + 1).min(ladders[ladder].rungs.len());
        for rung in near.filter(|rung| *rung != own) {
            let changed = with_rung(place, ladder, rung);
            let further = if most > 1 { about(ladders, &changed, ladder + 1, most - 1) } else { Vec::new() };
            places.push(changed);
            places.extend(further);
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::super::needs::Needs;
    use super::super::space::spaces;
    use super::*;

    /// A full sweep of a scene (`examples/pages/plan.rs`): the space, rungs and reading of each place.
    type Swept = Vec<(usize, Rungs, Reading)>;

    /// The spaces that were swept.
    fn swept_spaces() -> Vec<Space> {
        let fixed = ["voxels=32", "bounces=2", "rays.bounce=1", "rays.glossy=8", "lights.shadow_rays=1"];
        let mut spaces = spaces(&Needs::default(), &fixed.map(str::to_owned)).unwrap();
        spaces.retain(|space| ["none", "rays", "lpv"].contains(&space.method.name()));
        spaces
    }

    fn sweeps() -> Vec<PathBuf> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/plan");
        std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect()
    }

    fn read(path: &Path, spaces: &[Space]) -> Swept {
        #[derive(serde::Deserialize)]
        struct Kept {
            rows: Vec<(String, Rungs, [f64; 2], f64)>,
        }
        let kept: Kept = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        let row = |(method, place, ms, error): (String, Rungs, [f64; 2], f64)| {
            let space = spaces.iter().position(|space| space.method.name() == method).unwrap();
            (space, place, reading(ms, error))
        };
        kept.rows.into_iter().map(row).collect()
    }

    /// The best reading that a search finds in a sweep, and the number of settings that it measured.
    fn found(swept: &Swept, spaces: &[Space], limits: Limits) -> (Reading, usize) {
        let mut search = Search::new(spaces, limits);
        let row = |space: usize, place: &[usize]| swept.iter().find(|row| row.0 == space && row.1 == place);
        search.run(&mut |space, place| Ok(row(space, place).expect("every place was swept").2.clone())).unwrap();
        assert!(search.finished);
        (search.best(None)[0].reading.clone(), search.points.len())
    }

    fn reading(ms: [f64; 2], error: f64) -> Reading {
        let passes = [("shade".into(), ms[0]), ("image".into(), ms[1])].into();
        Reading { ms: ms[0] + ms[1], passes, bytes: 1 << 20, error }
    }

    /// A pseudo-random number from 0 to 1 that only depends on these words.
    fn chance(of: &str) -> f64 {
        let hash = blake3::hash(of.as_bytes());
        f64::from(u32::from_le_bytes(hash.as_bytes()[..4].try_into().unwrap())) / f64::from(u32::MAX)
    }

    /// A sweep of a synthetic scene: ladders multiply the times of two passes, squares of errors add up, and a small
    /// part follows no rule.
    fn made(seed: u64, spaces: &[Space]) -> Swept {
        let mut swept = Swept::new();
        for (index, space) in spaces.iter().enumerate() {
            let of_method = |what: &str| chance(&format!("{seed} {index} {what}"));
            let missing = if space.method.name() == "none" { 0.03 } else { 0.0 };
            let (voxels, square) = (30.0 * (1.0 + of_method("time")), 0.003 * of_method("error").powi(2) + missing);
            let ladder = |ladder: &Ladder| {
                let of = |what: &str| chance(&format!("{seed} {} {what}", ladder.key));
                (usize::from(of("pass") >= 0.3), 1.0 + 0.8 * of("time"), 0.02 * of("error").powi(3))
            };
            let ladders: Vec<(usize, f64, f64)> = space.ladders.iter().map(ladder).collect();
            for place in space.places() {
                let odd = 1.0 + 0.04 * (of_method(&format!("{place:?}")) - 0.5);
                let (mut ms, mut square) = ([voxels, 60.0], square);
                for ((pass, factor, error), &rung) in ladders.iter().zip(&place) {
                    ms[*pass] *= factor.powi(rung as i32);
                    square += error / (1.0 + 2.0 * rung as f64).powi(2);
                }
                swept.push((index, place, reading([ms[0] * odd, ms[1]], square.sqrt() * odd)));
            }
        }
        swept
    }

    /// In nine of ten searches the best found time is within a tenth of the best one, after measuring one setting in
    /// `few`. Limits are such that a given percentage of the settings hold them.
    fn assert_near(sweeps: impl Iterator<Item = Swept>, spaces: &[Space], percents: &[usize], few: usize) {
        let (mut asked, mut all, mut ratios) = (0, 0, Vec::new());
        for swept in sweeps {
            let mut errors: Vec<f64> = swept.iter().map(|row| row.2.error).collect();
            errors.sort_by(f64::total_cmp);
            for percent in percents {
                let limits = Limits { error: Some(errors[errors.len() * percent / 100]), ..Limits::default() };
                let held = swept.iter().filter(|row| limits.hold(&row.2));
                let truth = held.map(|row| row.2.ms).min_by(f64::total_cmp).unwrap();
                let (best, points) = found(&swept, spaces, limits);
                assert!(limits.hold(&best), "{best:?} of {limits:?}");
                ratios.push(best.ms / truth);
                (asked, all) = (asked + points, all + swept.len());
            }
        }
        let near = ratios.iter().filter(|ratio| **ratio <= 1.1).count();
        assert!(ratios.len() >= 30 && 10 * near >= 9 * ratios.len(), "{near} of {}: {ratios:.2?}", ratios.len());
        assert!(few * asked < all, "{asked} of {all}");
    }

    /// All 364 settings for scenes of five kinds.
    #[test]
    fn it_finds_nearly_the_best_of_full_sweeps() {
        let spaces = swept_spaces();
        assert_near(sweeps().iter().map(|path| read(path, &spaces)), &spaces, &[5, 10, 20, 35, 50, 70], 14);
    }

    /// Scenes with lamps, of some 10,000 settings each.
    #[test]
    fn it_finds_nearly_the_best_of_a_hundred_made_scenes() {
        let fixed = ["image.direct=samples", "image.interleave=4", "rays.bounce=2", "lights.voxel_lamp_points=4"];
        let needs = Needs { lamps: true, ..Needs::default() };
        let mut spaces = spaces(&needs, &fixed.map(str::to_owned)).unwrap();
        spaces.retain(|space| ["none", "rays", "lpv", "photons"].contains(&space.method.name()));
        assert_near((0..100).map(|seed| made(seed, &spaces)), &spaces, &[20], 10);
    }

    #[test]
    fn without_a_place_that_holds_it_finds_the_nearest() {
        let spaces = swept_spaces();
        for path in sweeps() {
            let swept = read(&path, &spaces);
            let least = swept.iter().map(|row| row.2.error).min_by(f64::total_cmp).unwrap();
            let limits = Limits { error: Some(0.5 * least), ..Limits::default() };
            let (best, _) = found(&swept, &spaces, limits);
            assert!(!limits.hold(&best) && best.error < 1.1 * least, "{path:?}: {} and {least}", best.error);
        }
    }
}
