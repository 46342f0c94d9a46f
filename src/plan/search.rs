//! Which settings are measured, and in which order: presets first, then steps of single ladders about the best, then the
//! combinations that these promise most of.

use std::cmp::Ordering;

use super::limits::{Limits, Score};
use super::model::Model;
use super::space::{Place, Space};
use crate::Result;

/// What one measuring tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Device time of a frame in milliseconds.
    pub ms: f64,
    /// The same, pass by pass.
    pub passes: Vec<(String, f64)>,
    /// Device memory.
    pub bytes: u64,
    /// As [`Limits::error`].
    pub error: f64,
}

/// A place that was measured.
#[derive(Clone, Debug)]
pub struct Point {
    /// Index of its space.
    pub space: usize,
    pub place: Place,
    pub reading: Reading,
}

impl Point {
    /// Whether the settings could run.
    pub fn ran(&self) -> bool {
        self.reading.error.is_finite() && self.reading.ms.is_finite()
    }
}

/// Measures settings.
pub trait Measure {
    /// `None` once no further one may be measured. What cannot run has an infinite time and error.
    ///
    /// # Errors
    /// What ends the whole search.
    fn measure(&mut self, space: usize, place: &Place) -> Result<Option<Reading>>;
}

/// A combination is measured if it promises to be better by such a share,
const WORTH: f64 = 0.03;
/// where time and error are taken for so much less per ladder that differs, since predictions are off by some percent each way,
const HOPE: f64 = 0.98;
/// until so many in a row broke that promise.
const MISSES: u32 = 6;
/// Ladders in which a combination differs from the best at once, and rungs on each.
const CHANGED: usize = 4;
const REACH: usize = 2;

pub struct Search<'a> {
    pub spaces: &'a [Space],
    pub limits: Limits,
    pub points: Vec<Point>,
    /// Whether it ended because nothing was left that promised more.
    pub finished: bool,
}

impl<'a> Search<'a> {
    pub fn new(spaces: &'a [Space], limits: Limits) -> Self {
        Self { spaces, limits, points: Vec::new(), finished: false }
    }

    /// Measures until nothing promises more, or no further settings may be measured.
    pub fn run(&mut self, measure: &mut dyn Measure) -> Result<()> {
        self.finished = self.race(measure)? && self.climb_all(measure)?;
        Ok(())
    }

    /// The places that do best, the best first: all, or those of one space.
    pub fn best(&self, space: Option<usize>) -> Vec<&Point> {
        let mut points: Vec<&Point> =
            self.points.iter().filter(|p| p.ran() && space.is_none_or(|s| s == p.space)).collect();
        points.sort_by(|a, b| self.score(a).compare(&self.score(b)));
        points
    }

    pub fn score(&self, point: &Point) -> Score {
        self.limits.score(&point.reading)
    }

    pub fn point(&self, space: usize, place: &Place) -> Option<&Point> {
        self.points.iter().find(|point| point.space == space && point.place == *place)
    }

    /// Whether it could be measured.
    fn look(&mut self, space: usize, place: &Place, measure: &mut dyn Measure) -> Result<bool> {
        if self.point(space, place).is_some() {
            return Ok(true);
        }
        let Some(reading) = measure.measure(space, place)? else { return Ok(false) };
        self.points.push(Point { space, place: place.clone(), reading });
        Ok(true)
    }

    /// Measures where searches begin: of each method the first; then further ones of the best method first, each until one does
    /// not do better.
    fn race(&mut self, measure: &mut dyn Measure) -> Result<bool> {
        let spaces = self.spaces;
        for (index, space) in spaces.iter().enumerate() {
            if !self.look(index, &space.starts[0], measure)? {
                return Ok(false);
            }
        }
        for index in self.order() {
            for pair in spaces[index].starts.windows(2) {
                if !self.look(index, &pair[1], measure)? {
                    return Ok(false);
                }
                let [before, now] =
                    [&pair[0], &pair[1]].map(|place| self.point(index, place).map(|point| self.score(point)));
                if before.zip(now).is_some_and(|(before, now)| before.compare(&now) == Ordering::Less) {
                    break;
                }
            }
        }
        Ok(true)
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

    /// Climbs from every method's best, the best method first: what steps do with one is a first guess for the others.
    fn climb_all(&mut self, measure: &mut dyn Measure) -> Result<bool> {
        for space in self.order() {
            if !self.climb(space, measure)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn climb(&mut self, space: usize, measure: &mut dyn Measure) -> Result<bool> {
        let mut misses = 0;
        loop {
            let Some(best) = self.best(Some(space)).first().copied().cloned() else { return Ok(true) };
            if let Some(step) = self.unknown_step(&best) {
                if !self.look(space, &step, measure)? {
                    return Ok(false);
                }
                continue;
            }
            let Some(place) = self.promising(&best).filter(|_| misses < MISSES) else { return Ok(true) };
            if !self.look(space, &place, measure)? {
                return Ok(false);
            }
            let found = self.point(space, &place).map(|point| self.score(point));
            let kept = found.is_some_and(|found| found.compare(&self.score(&best)) == Ordering::Less);
            misses = if kept { 0 } else { misses + 1 };
        }
    }

    /// A step of a ladder next to a place that nothing is known of yet: down first.
    fn unknown_step(&self, from: &Point) -> Option<Place> {
        let model = Model::new(self.spaces, &self.points, (from.space, &from.place));
        let ladders = &self.spaces[from.space].ladders;
        let steps = (0..ladders.len()).map(|ladder| (ladder, from.place[ladder].checked_sub(1)));
        let up = |ladder: usize| Some(from.place[ladder] + 1).filter(|rung| *rung < ladders[ladder].rungs.len());
        let steps = steps.chain((0..ladders.len()).map(|ladder| (ladder, up(ladder))));
        let places = steps.filter_map(|(ladder, rung)| {
            let rung = rung.filter(|rung| !model.knows(ladder, from.place[ladder], *rung))?;
            let mut place = from.place.clone();
            place[ladder] = rung;
            Some(place)
        });
        places.into_iter().find(|place| self.point(from.space, place).is_none())
    }

    /// The place about the best that is predicted to do better than it, and best of all that were not measured.
    fn promising(&self, best: &Point) -> Option<Place> {
        let model = Model::new(self.spaces, &self.points, (best.space, &best.place));
        let target = self.score(best);
        let mut found: Option<(Score, Place)> = None;
        self.about(best, &mut |place| {
            if self.point(best.space, place).is_some() {
                return;
            }
            let changed = best.place.iter().zip(place).filter(|(a, b)| a != b).count() as i32;
            let hope = HOPE.powi(changed);
            let hoped = |reading: Reading| Reading { ms: reading.ms * hope, error: reading.error * hope, ..reading };
            let Some(score) = model.predict(place).map(|reading| self.limits.score(&hoped(reading))) else { return };
            let better = found.as_ref().is_none_or(|(least, _)| score.compare(least) == Ordering::Less);
            if better && score.beats(&target, WORTH) {
                found = Some((score, place.clone()));
            }
        });
        found.map(|(_, place)| place)
    }

    /// Every place that differs from a point in few ladders by few rungs.
    fn about(&self, from: &Point, visit: &mut dyn FnMut(&Place)) {
        #[expect(clippy::too_many_arguments, reason = "a recursion within one function")]
        fn go(
            search: &Search,
            from: &Point,
            first: usize,
            left: usize,
            place: &mut Place,
            visit: &mut dyn FnMut(&Place),
        ) {
            let ladders = &search.spaces[from.space].ladders;
            for ladder in first..ladders.len() {
                let own = place[ladder];
                for rung in own.saturating_sub(REACH)..(own + REACH + 1).min(ladders[ladder].rungs.len()) {
                    if rung != own {
                        place[ladder] = rung;
                        visit(place);
                        if left > 1 {
                            go(search, from, ladder + 1, left - 1, place, visit);
                        }
                    }
                }
                place[ladder] = own;
            }
        }
        go(self, from, 0, CHANGED, &mut from.place.clone(), visit);
    }
}

#[cfg(test)]
mod tests {
    use super::super::needs::Needs;
    use super::super::space::spaces;
    use super::*;

    /// A scene's response: each ladder's rungs have a weight in time and a share of the error.
    struct Made<'a> {
        spaces: &'a [Space],
        seed: u64,
        asked: usize,
    }

    fn chance(seed: u64, of: &str) -> f64 {
        let hash = blake3::hash(format!("{seed} {of}").as_bytes());
        f64::from(u32::from_le_bytes(hash.as_bytes()[..4].try_into().unwrap())) / f64::from(u32::MAX)
    }

    impl Made<'_> {
        /// Times of two passes that ladders multiply, squares of errors that add up, and a little that fits no such rule.
        fn reading(&self, index: usize, place: &Place) -> Reading {
            let space = &self.spaces[index];
            let of_method = |what: &str| chance(self.seed, &format!("{index} {what}"));
            let (mut voxels, mut image) = (30.0 * (1.0 + of_method("time")), 60.0);
            let mut square = 0.003 * of_method("error").powi(2);
            square += if space.method.name() == "none" { 0.03 } else { 0.0 };
            for (ladder, &rung) in space.ladders.iter().zip(place) {
                let of = |what: &str| chance(self.seed, &format!("{} {what}", ladder.key));
                let pass = if of("pass") < 0.3 { &mut voxels } else { &mut image };
                *pass *= (1.0 + 0.8 * of("time")).powi(rung as i32);
                square += 0.02 * of("error").powi(3) / (1.0 + 2.0 * rung as f64).powi(2);
            }
            let odd = 1.0 + 0.04 * (chance(self.seed, &format!("{index} {place:?}")) - 0.5);
            let passes = vec![("shade".into(), voxels * odd), ("image".into(), image)];
            Reading { ms: voxels * odd + image, passes, bytes: 1 << 20, error: square.sqrt() * odd }
        }
    }

    impl Measure for Made<'_> {
        fn measure(&mut self, space: usize, place: &Place) -> Result<Option<Reading>> {
            self.asked += 1;
            Ok(Some(self.reading(space, place)))
        }
    }

    /// Within a tenth of the best of all combinations in nine of ten scenes, after a small part of their number.
    #[test]
    fn it_finds_nearly_the_best_of_many_by_few() {
        const SCENES: u64 = 100;
        let needs = Needs { lamps: true, ..Needs::NOTHING };
        let fixed = ["image.direct=samples", "image.interleave=4", "rays.bounce=2", "lights.voxel_lamp_points=4"];
        let mut spaces = spaces(&needs, &fixed.map(str::to_owned)).unwrap();
        spaces.retain(|space| ["rays", "photons", "lpv", "none"].contains(&space.method.name()));
        let (mut near, mut asked, mut all) = (0, 0, 0);
        for seed in 0..SCENES {
            let mut made = Made { spaces: &spaces, seed, asked: 0 };
            let places =
                spaces.iter().enumerate().flat_map(|(s, space)| space.places().into_iter().map(move |p| (s, p)));
            let readings: Vec<Reading> = places.map(|(space, place)| made.reading(space, &place)).collect();
            let mut errors: Vec<f64> = readings.iter().map(|reading| reading.error).collect();
            errors.sort_by(f64::total_cmp);
            let limits = Limits { error: Some(errors[errors.len() / 5]), ..Limits::default() };
            let held = readings.iter().filter(|reading| limits.hold(reading));
            let truth = held.map(|reading| reading.ms).min_by(f64::total_cmp).unwrap();
            let mut search = Search::new(&spaces, limits);
            search.run(&mut made).unwrap();
            let best = &search.best(None)[0].reading;
            assert!(search.finished && limits.hold(best), "{seed}: {best:?} of {limits:?}");
            near += u64::from(best.ms <= 1.1 * truth);
            (asked, all) = (asked + made.asked, all + readings.len());
        }
        assert!(10 * near >= 9 * SCENES, "{near} of {SCENES}");
        assert!(10 * asked < all, "{asked} of {all}");
    }

    /// A full sweep of a scene (`examples/plan_table.rs`).
    struct Swept {
        rows: Vec<(usize, Place, Reading)>,
        asked: usize,
    }

    impl Measure for Swept {
        fn measure(&mut self, space: usize, place: &Place) -> Result<Option<Reading>> {
            self.asked += 1;
            let row = self.rows.iter().find(|row| row.0 == space && row.1 == *place);
            Ok(Some(row.expect("every place was swept").2.clone()))
        }
    }

    impl Swept {
        fn of(path: &std::path::Path, spaces: &[Space]) -> Self {
            #[derive(serde::Deserialize)]
            struct Kept {
                rows: Vec<(String, Place, [f64; 2], f64)>,
            }
            let kept: Kept = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
            let row = |(method, place, [voxels, pixels], error): (String, Place, [f64; 2], f64)| {
                let passes = vec![("shade".into(), voxels), ("image".into(), pixels)];
                let space = spaces.iter().position(|space| space.method.name() == method).unwrap();
                (space, place, Reading { ms: voxels + pixels, passes, bytes: 1 << 20, error })
            };
            Self { rows: kept.rows.into_iter().map(row).collect(), asked: 0 }
        }
    }

    /// Within a tenth of the best of all 364 settings in nine of ten cases, by measuring one in fourteen: scenes of five kinds,
    /// each with limits that 5 to 70 % of the settings hold.
    #[test]
    fn it_finds_nearly_the_best_of_full_sweeps() {
        let fixed = ["voxels=32", "bounces=2", "rays.bounce=1", "rays.glossy=8", "lights.shadow_rays=1"];
        let mut spaces = spaces(&Needs::NOTHING, &fixed.map(str::to_owned)).unwrap();
        spaces.retain(|space| ["none", "rays", "lpv"].contains(&space.method.name()));
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/plan");
        let (mut asked, mut all, mut ratios) = (0, 0, Vec::new());
        for file in std::fs::read_dir(folder).unwrap() {
            let mut swept = Swept::of(&file.unwrap().path(), &spaces);
            let mut errors: Vec<f64> = swept.rows.iter().map(|row| row.2.error).collect();
            errors.sort_by(f64::total_cmp);
            for percent in [5, 10, 20, 35, 50, 70] {
                let limits = Limits { error: Some(errors[errors.len() * percent / 100]), ..Limits::default() };
                let held = swept.rows.iter().filter(|row| limits.hold(&row.2));
                let truth = held.map(|row| row.2.ms).min_by(f64::total_cmp).unwrap();
                let mut search = Search::new(&spaces, limits);
                search.run(&mut swept).unwrap();
                ratios.push(search.best(None)[0].reading.ms / truth);
                all += swept.rows.len();
            }
            asked += swept.asked;
        }
        let near = ratios.iter().filter(|ratio| **ratio <= 1.1).count();
        assert!(ratios.len() >= 30 && 10 * near >= 9 * ratios.len(), "{near} of {}: {ratios:.2?}", ratios.len());
        assert!(14 * asked < all, "{asked} of {all}");
    }

    #[test]
    fn without_a_place_that_holds_it_finds_the_nearest() {
        let spaces = spaces(&Needs::NOTHING, &["method=rays".into(), "image.interleave=4".into()]).unwrap();
        let mut made = Made { spaces: &spaces, seed: 3, asked: 0 };
        let places = spaces[0].places();
        let least = places.iter().map(|place| made.reading(0, place).error).min_by(f64::total_cmp).unwrap();
        let limits = Limits { error: Some(0.5 * least), ..Limits::default() };
        let mut search = Search::new(&spaces, limits);
        search.run(&mut made).unwrap();
        let best = &search.best(None)[0].reading;
        assert!(!limits.hold(best) && best.error < 1.1 * least, "{} and {least}", best.error);
    }
}
