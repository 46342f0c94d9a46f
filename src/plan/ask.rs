//! From a question to its answer: references as fine as the limit asks for, the search, the best few timed in turns and looked at
//! from every view.

mod conclude;

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::answer::{Answer, Choice};
use super::bench::{Bench, Host, Seen, Timed, samples, seen_key};
use super::limits::Limits;
use super::needs::Needs;
use super::search::{Measure, Point, Reading, Search};
use super::space::{Place, Space, as_preset, spaces};
use crate::chart::row::Part;
use crate::gi::Method;
use crate::lab::store::Results;
use crate::measure::timing::Spread;
use crate::renderer::RenderOptions;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::vk::Context;
use crate::{Error, Result};

/// What is asked.
pub struct Question<'a> {
    pub context: &'a Arc<Context>,
    pub scene: &'a Scene,
    /// Of the images that are asked for.
    pub options: RenderOptions,
    /// Where the settings are to hold: one at least.
    pub views: Vec<Seen>,
    /// Where the winner is checked.
    pub held_out: Vec<Seen>,
    pub limits: Limits,
    pub part: Part,
    /// What may be chosen among.
    pub methods: Vec<Method>,
    /// `key=value` that all settings have.
    pub fixed: Vec<String>,
    pub budget: Duration,
}

/// Errors are measured of images of so many pixels at most: more cost references time and tell little more.
const MOST_PIXELS: u32 = 128 * 96;

/// The part of the budget that references may take before the search, and after which nothing further is searched.
const FOR_REFERENCES: f64 = 0.35;
const FOR_SEARCH: f64 = 0.75;
/// Where there are several views, the part after which the first one is not searched on: what it finds may not hold at the others.
const FOR_FIRST_VIEW: f64 = 0.5;

/// The reference's noise over the error that is to be told: below, the error is off by a twentieth at most (√(1 + ⅓²)); and the
/// most at which a limit can be told to hold at all.
const FINE: f64 = 1.0 / 3.0;
const COARSE: f64 = 0.6;

/// Without a limit on the error, references are made so fine first.
const FIRST_NOISE: f64 = 0.1;

/// Settings that are timed at the end, and how often.
const FINALISTS: usize = 4;
const ROUNDS: usize = 5;

/// Levels of references: 16 to 262144 samples a pixel.
const MOST_LEVEL: u32 = 7;

/// The size of the images whose errors are measured.
pub fn error_size((width, height): (u32, u32)) -> (u32, u32) {
    let shrink = (f64::from(width) * f64::from(height) / f64::from(MOST_PIXELS)).sqrt().max(1.0);
    let side = |side: u32| ((f64::from(side) / shrink).round() as u32).max(1);
    (side(width), side(height))
}

/// The key under which the answer to a question is kept.
pub fn key(question: &Question, store: &Results) -> String {
    let Question { scene, options, views, held_out, limits, part, methods, fixed, budget, .. } = question;
    let seen: Vec<String> = views.iter().chain(held_out).map(|seen| seen_key(scene, seen, options.size)).collect();
    let (bounds, limit) = (options.bounds, options.memory_limit);
    store.key(&format!("answer {seen:?} {bounds:?} {limit:?} {limits:?} {part:?} {methods:?} {fixed:?} {budget:?}"))
}

/// Measures until the answer is known or the budget is spent.
///
/// # Errors
/// A limit on the error that no reference within the budget can tell, with what it would take; settings that make no sense;
/// whatever ends a frame.
pub fn ask(question: &Question, host: &dyn Host, store: &Results) -> Result<Answer> {
    let size = error_size(question.options.size);
    let bench =
        Bench::new((question.context, host, store), question.scene, question.options.clone(), (size, question.part));
    let needs = Needs::of(question.scene);
    let mut spaces = spaces(&needs, &question.fixed)?;
    // Without indirect light, all of it is missing.
    let of_use = |method: Method| method != Method::None || question.part == Part::Total;
    spaces.retain(|space| question.methods.contains(&space.method) && of_use(space.method));
    if spaces.is_empty() {
        return Err(Error::Usage("--methods, --set method and --error-of leave no method".into()));
    }
    Asking { question, needs, bench, host, spaces, start: Instant::now(), level: 0, guide: 0, pace: None }.answer()
}

struct Asking<'a> {
    question: &'a Question<'a>,
    needs: Needs,
    bench: Bench<'a>,
    host: &'a dyn Host,
    spaces: Vec<Space>,
    start: Instant,
    /// Of the references.
    level: u32,
    /// The view that is searched.
    guide: usize,
    /// Seconds that a sample of all pixels takes, once known.
    pace: Option<f64>,
}

/// Measures for the search: at the guiding view.
struct Looking<'b, 'a> {
    asking: &'b mut Asking<'a>,
    until: Instant,
    looked: usize,
}

impl Measure for Looking<'_, '_> {
    fn measure(&mut self, space: usize, place: &Place) -> Result<Option<Reading>> {
        // The first tells at least something.
        if self.looked > 0 && Instant::now() > self.until {
            return Ok(None);
        }
        self.looked += 1;
        let settings = self.asking.spaces[space].settings(place);
        let (preset, sets) = as_preset(&settings);
        self.asking.host.is_at(format!("{} settings measured: {preset} {}", self.looked - 1, sets.join(" ")));
        self.asking.reading(&settings, self.asking.guide).map(Some)
    }
}

impl Asking<'_> {
    fn after(&self, share: f64) -> Instant {
        self.start + self.question.budget.mul_f64(share)
    }

    fn answer(mut self) -> Result<Answer> {
        let wanted = self.question.limits.error.map_or(FIRST_NOISE, |error| FINE * error);
        self.refine(wanted, FOR_REFERENCES)?;
        let noise = self.noise()?;
        if let Some(error) = self.question.limits.error.filter(|error| noise > COARSE * error) {
            return Err(self.too_fine(error, noise));
        }
        let first = if self.question.views.len() > 1 { FOR_FIRST_VIEW } else { FOR_SEARCH };
        let (mut points, mut finished) = self.search(Vec::new(), first)?;
        // References as fine as what was found asks for: then the same settings are looked at again.
        let best = ranked(&points, &self.question.limits).first().map_or(1.0, |point| point.reading.error);
        let before = self.level;
        self.refine(FINE * self.question.limits.error.map_or(best, |error| error.min(best)), FOR_SEARCH)?;
        if self.level > before {
            points = self.again(points)?;
            (points, finished) = self.search(points, first)?;
        }
        let mut chosen = self.finals(&points)?;
        // Where another view is worse, that one guides what is searched on.
        let mut tried = vec![self.guide];
        while let Some(worst) = self.worst_view(&chosen[0].1)?.filter(|view| !tried.contains(view)) {
            if self.question.limits.error.is_none_or(|limit| chosen[0].0.error <= limit)
                || Instant::now() > self.after(FOR_SEARCH)
            {
                break;
            }
            (self.guide, tried) = (worst, [tried, vec![worst]].concat());
            points =
                self.again(ranked(&points, &self.question.limits).into_iter().take(2 * FINALISTS).cloned().collect())?;
            (points, finished) = self.search(points, FOR_SEARCH)?;
            chosen = self.finals(&points)?;
        }
        self.conclude(&points, chosen, finished)
    }

    /// Searches on from what is known, up to a part of the budget.
    fn search(&mut self, points: Vec<Point>, share: f64) -> Result<(Vec<Point>, bool)> {
        let (spaces, limits, until) = (self.spaces.clone(), self.question.limits, self.after(share));
        let mut search = Search::new(&spaces, limits);
        let looked = points.len();
        search.points = points;
        search.run(&mut Looking { asking: self, until, looked })?;
        Ok((search.points, search.finished))
    }

    /// The same places against the present reference, at the present view.
    fn again(&mut self, points: Vec<Point>) -> Result<Vec<Point>> {
        let again = |point: Point| {
            let settings = self.spaces[point.space].settings(&point.place);
            Ok(Point { reading: self.reading(&settings, self.guide)?, ..point })
        };
        points.into_iter().map(again).collect()
    }

    /// What settings give at a view. What cannot run is infinitely bad.
    fn reading(&mut self, settings: &Settings, view: usize) -> Result<Reading> {
        self.reading_by(settings, &self.question.views[view].clone(), 0)
    }

    /// Against one of the two references.
    fn reading_by(&mut self, settings: &Settings, seen: &Seen, copy: u64) -> Result<Reading> {
        let reference = self.bench.reference(seen, self.level, copy)?;
        match self.bench.row(settings, seen)? {
            Ok(row) => self.bench.reading(&row, &reference),
            Err(_) => Ok(Reading { ms: f64::INFINITY, passes: vec![], bytes: u64::MAX, error: f64::INFINITY }),
        }
    }

    /// Of the guiding view's reference.
    fn noise(&mut self) -> Result<f64> {
        self.bench.noise(&self.question.views[self.guide], self.level)
    }

    /// Makes finer references until their noise is at most this, or the next ones would take more than a share of the budget.
    fn refine(&mut self, wanted: f64, share: f64) -> Result<()> {
        loop {
            let began = Instant::now();
            let noise = self.noise()?;
            let took = began.elapsed().as_secs_f64();
            let pace = match self.pace {
                // What comes from the cache tells none.
                _ if took > 0.05 => took / (2.0 * f64::from(samples(self.level))),
                Some(pace) => pace,
                None => self.bench.pace(&self.question.views[self.guide])?,
            };
            self.pace = Some(pace);
            let next = pace * 2.0 * f64::from(samples(self.level + 1));
            let in_time = Instant::now() + Duration::from_secs_f64(next.min(1e6)) < self.after(share);
            if noise <= wanted || !in_time || self.level == MOST_LEVEL {
                return Ok(());
            }
            self.level += 1;
        }
    }

    fn too_fine(&self, error: f64, noise: f64) -> Error {
        let needed = 2.0 * f64::from(samples(self.level)) * (noise / (COARSE * error)).powi(2);
        let budget = self.pace.unwrap_or(1e-3) * needed / FOR_REFERENCES;
        let budget = if budget < 600.0 {
            format!("{:.0}s", budget.max(1.0))
        } else {
            format!("{:.0}min", (budget / 60.0).ceil())
        };
        let samples = samples(self.level);
        Error::Usage(format!(
            "--max-error {error}: the reference's own noise is {noise:.4} after {samples} samples a pixel, so no image can be told to \
             be as right as that; about --budget {budget} would do, or allow more"
        ))
    }

    /// The best places at all views, timed in turns: the best first.
    fn finals(&mut self, points: &[Point]) -> Result<Vec<(Choice, Point)>> {
        let limits = self.question.limits;
        let best: Vec<Point> = ranked(points, &limits).into_iter().take(FINALISTS).cloned().collect();
        if best.is_empty() {
            let why = points.first().map(|point| self.spaces[point.space].settings(&point.place));
            let why = why.map(|settings| self.bench.row(&settings, &self.question.views[0].clone())).transpose()?;
            let why = why.and_then(|row| row.err()).unwrap_or_default();
            return Err(Error::Usage(format!("none of the settings could run: {why}")));
        }
        let settings: Vec<Settings> =
            best.iter().map(|point| self.spaces[point.space].settings(&point.place)).collect();
        let views = self.question.views.clone();
        let timed = self.bench.times(&settings, &views, ROUNDS, self.after(0.9))?;
        let mut finals = Vec::new();
        for ((mut point, settings), timed) in best.into_iter().zip(settings).zip(timed) {
            for view in 0..views.len() {
                let reading = self.reading(&settings, view)?;
                point.reading.error = if view == 0 { reading.error } else { point.reading.error.max(reading.error) };
            }
            let choice = choice(settings, &timed, point.reading.error);
            // A limit is on what is seen; what is cheapest is told by what other programs disturb least.
            let idle =
                self.bench.on_idle(Spread::of(timed.cpu_ms.iter().copied()).median).filter(|_| limits.ms.is_none());
            let ms = idle.filter(|ms| *ms > 0.0).unwrap_or(choice.ms.median);
            point.reading = Reading { ms, passes: median_passes(&timed), bytes: timed.bytes, ..point.reading };
            finals.push((choice, point));
        }
        finals.sort_by(|a, b| limits.score(&a.1.reading).compare(&limits.score(&b.1.reading)));
        Ok(finals)
    }

    /// The view at which a place's error is largest; `None` with a single view.
    fn worst_view(&mut self, point: &Point) -> Result<Option<usize>> {
        let settings = self.spaces[point.space].settings(&point.place);
        let mut worst: Option<(f64, usize)> = None;
        for view in 0..self.question.views.len() {
            let error = self.reading(&settings, view)?.error;
            if worst.is_none_or(|(most, _)| error > most) {
                worst = Some((error, view));
            }
        }
        Ok(worst.map(|(_, view)| view).filter(|_| self.question.views.len() > 1))
    }
}

/// The places that ran, the best first.
fn ranked<'a>(points: &'a [Point], limits: &Limits) -> Vec<&'a Point> {
    let mut ran: Vec<&Point> = points.iter().filter(|point| point.ran()).collect();
    ran.sort_by(|a, b| limits.score(&a.reading).compare(&limits.score(&b.reading)));
    ran
}

fn choice(settings: Settings, timed: &Timed, error: f64) -> Choice {
    let (preset, sets) = as_preset(&settings);
    let (ms, frames) = (Spread::of(timed.frames.iter().copied()), timed.frames.len());
    Choice { preset: preset.to_owned(), sets, settings, ms, frames, bytes: timed.bytes, error }
}

fn median_passes(timed: &Timed) -> Vec<(String, f64)> {
    let first = timed.passes.first().map_or(&[][..], |passes| passes);
    let of = |name: &String| {
        let ms = timed.passes.iter().flatten().filter(|pass| pass.0 == *name).map(|pass| pass.1);
        Spread::of(ms).median
    };
    first.iter().map(|(name, _)| (name.clone(), of(name))).collect()
}
