//! From a question to its answer: references with the precision that the limit needs, the search, the best few timed in
//! turns and checked at every view, and the winner checked at further views.

use std::time::{Duration, Instant};

use super::VERSION;
use super::answer::{Answer, Binds, Choice, Confidence, HeldOut, Neighbour, Neighbours, PassShare};
use super::bench::{Bench, PlanView, passes};
use super::limits::Limits;
use super::model::Model;
use super::needs::Needs;
use super::search::{Point, Reading, Search, with_rung};
use super::space::{Ladder, as_preset, spaces};
use crate::gi::Method;
use crate::measure::metrics::Part;
use crate::settings::Settings;
use crate::stability::warnings;
use crate::{Error, Result};

/// A question to `plan`.
pub struct Question {
    /// The views at which the settings must hold: at least one.
    pub views: Vec<PlanView>,
    /// Further views at which the winner is checked.
    pub held_out: Vec<PlanView>,
    pub limits: Limits,
    /// Methods that may be chosen.
    pub methods: Vec<Method>,
    /// `key=value` of fixed settings.
    pub fixed: Vec<String>,
    pub budget: Duration,
}

/// The maximum number of pixels of images whose errors are measured: references for more pixels take time and add
/// little.
const MOST_PIXELS: u32 = 128 * 96;

/// The share of the budget for references before the search; afterwards nothing further is searched.
const FOR_REFERENCES: f64 = 0.35;
const FOR_SEARCH: f64 = 0.75;
/// With several views, the share after which the search at the first one ends, because its results may not hold at the
/// others.
const FOR_FIRST_VIEW: f64 = 0.5;

/// The largest noise of a reference relative to the error to measure: the error is then off by at most a twentieth (√(1
/// + ⅓²)); and the largest at which a limit can be decided at all.
const FINE: f64 = 1.0 / 3.0;
const COARSE: f64 = 0.6;

/// The first noise of references without a limit on the error.
const FIRST_NOISE: f64 = 0.1;

/// The number of settings that are timed at the end, and of their rounds.
const FINALISTS: usize = 4;
const ROUNDS: usize = 5;

/// The size of the images whose errors are measured.
pub fn error_size((width, height): (u32, u32)) -> (u32, u32) {
    let shrink = (f64::from(width) * f64::from(height) / f64::from(MOST_PIXELS)).sqrt().max(1.0);
    let side = |side: u32| ((f64::from(side) / shrink).round() as u32).max(1);
    (side(width), side(height))
}

/// The key of the stored answer to a question.
pub fn key(question: &Question, bench: &Bench) -> String {
    let Question { views, held_out, limits, methods, fixed, budget } = question;
    let (options, part) = (&bench.setup.options, bench.setup.part);
    let all = views.iter().chain(held_out);
    let seen: Vec<String> = all.map(|seen| seen.key(bench.setup.scene, options.size)).collect();
    let (bounds, limit) = (options.bounds, options.memory_limit);
    let about = format!("answer {seen:?} {bounds:?} {limit:?} {limits:?} {part:?} {methods:?} {fixed:?} {budget:?}");
    bench.setup.store.key(&about)
}

/// Measures until the answer is known or the budget is spent.
///
/// # Errors
/// A limit on the error that no reference within the budget can decide, with the budget that it would need; invalid
/// settings; errors of frames.
pub fn ask(question: &Question, bench: Bench) -> Result<Answer> {
    let mut spaces = spaces(&Needs::of_scene(bench.setup.scene), &question.fixed)?;
    // Without indirect light, its error is 1.
    let of_use = |method: Method| method != Method::None || bench.setup.part == Part::Total;
    spaces.retain(|space| question.methods.contains(&space.method) && of_use(space.method));
    if spaces.is_empty() {
        return Err(Error::Usage("--methods, --set method and --error-of leave no method".into()));
    }
    let search = Search::new(&spaces, question.limits);
    Asking { question, bench, search, start: Instant::now(), guide: 0 }.answer()
}

struct Asking<'a> {
    question: &'a Question,
    bench: Bench<'a>,
    search: Search<'a>,
    start: Instant,
    /// The view that guides the search.
    guide: usize,
}

impl Asking<'_> {
    fn after(&self, share: f64) -> Instant {
        self.start + self.question.budget.mul_f64(share)
    }

    fn settings(&self, point: &Point) -> Settings {
        self.search.spaces[point.space].settings(&point.place)
    }

    fn answer(mut self) -> Result<Answer> {
        let (limit, views) = (self.question.limits.error, &self.question.views);
        self.refine(limit.map_or(FIRST_NOISE, |error| FINE * error), FOR_REFERENCES)?;
        let noise = self.bench.noise(&views[self.guide])?;
        if let Some(error) = limit.filter(|error| noise > COARSE * error) {
            return Err(self.too_fine(error, noise));
        }
        let first = if views.len() > 1 { FOR_FIRST_VIEW } else { FOR_SEARCH };
        self.search(first)?;
        // References get the precision that the found error needs, and the settings are compared with them again.
        let best = self.search.best(None).first().map_or(1.0, |point| point.reading.error);
        let before = self.bench.level;
        self.refine(FINE * limit.map_or(best, |error| error.min(best)), FOR_SEARCH)?;
        if self.bench.level > before {
            self.read_again(self.search.points.clone())?;
            self.search(first)?;
        }
        let mut chosen = self.finals()?;
        // If another view is worse, it guides the rest of the search.
        let mut tried = vec![self.guide];
        while limit.is_some_and(|limit| chosen[0].0.error > limit) && Instant::now() <= self.after(FOR_SEARCH) {
            let worst = self.worst_view(&chosen[0].0.settings)?;
            if tried.contains(&worst) {
                break;
            }
            self.guide = worst;
            tried.push(worst);
            self.read_again(self.search.best(None).into_iter().take(2 * FINALISTS).cloned().collect())?;
            self.search(FOR_SEARCH)?;
            chosen = self.finals()?;
        }
        self.conclude(chosen)
    }

    /// Continues the search up to a share of the budget.
    fn search(&mut self, share: f64) -> Result<()> {
        let until = self.after(share);
        let Self { question, bench, search, guide, .. } = self;
        let (spaces, mut looked) = (search.spaces, search.points.len());
        let searched = search.run(&mut |space, place| {
            // One setting is measured even without remaining time, so that there is an answer.
            if looked > 0 && Instant::now() > until {
                return Err(Error::Interrupted);
            }
            let settings = spaces[space].settings(place);
            let (preset, sets) = as_preset(&settings);
            (bench.setup.is_at)(format!("{looked} settings measured: {preset} {}", sets.join(" ")));
            looked += 1;
            bench.reading(&settings, &question.views[*guide], 0)
        });
        match searched {
            Err(Error::Interrupted) if Instant::now() > until => Ok(()),
            other => other,
        }
    }

    /// Continues with only these places, against the current reference, at the current view.
    fn read_again(&mut self, mut points: Vec<Point>) -> Result<()> {
        for point in &mut points {
            point.reading = self.bench.reading(&self.settings(point), &self.question.views[self.guide], 0)?;
        }
        self.search.points = points;
        Ok(())
    }

    /// Makes finer references until their noise is at most `wanted`, or the next ones would exceed a share of the
    /// budget.
    fn refine(&mut self, wanted: f64, share: f64) -> Result<()> {
        let until = self.after(share);
        self.bench.refine(&self.question.views[self.guide], wanted, until)
    }

    fn too_fine(&self, error: f64, noise: f64) -> Error {
        let samples = self.bench.samples();
        let needed = 2.0 * f64::from(samples) * (noise / (COARSE * error)).powi(2);
        let budget = self.bench.pace.unwrap_or(1e-3) * needed / FOR_REFERENCES;
        let budget = if budget < 600.0 {
            format!("{:.0}s", budget.max(1.0))
        } else {
            format!("{:.0}min", (budget / 60.0).ceil())
        };
        Error::Usage(format!(
            "--max-error {error}: the reference's own noise is {noise:.4} after {samples} samples a pixel, which hides a smaller \
             error: search longer, with about --budget {budget}, or allow a larger error"
        ))
    }

    /// The best settings at all views, timed in turns: the best first.
    fn finals(&mut self) -> Result<Vec<(Choice, Point)>> {
        let (limits, views) = (self.question.limits, &self.question.views);
        let best: Vec<Point> = self.search.best(None).into_iter().take(FINALISTS).cloned().collect();
        if best.is_empty() {
            let tried = self.search.points.first().map(|point| self.settings(point));
            let why = match tried.map(|settings| self.bench.row(&settings, &views[0])) {
                Some(Err(Error::Memory(why) | Error::Usage(why))) => why,
                Some(Err(error)) => return Err(error),
                _ => String::new(),
            };
            return Err(Error::Usage(format!("none of the settings could run: {why}")));
        }
        let settings: Vec<Settings> = best.iter().map(|point| self.settings(point)).collect();
        let timed = self.bench.times(&settings, views, ROUNDS, self.after(0.9))?;
        let mut finals = Vec::new();
        for ((mut point, settings), (timings, bytes)) in best.into_iter().zip(settings).zip(timed) {
            let error = self.worst_error(&settings, 0)?;
            let (preset, sets) = as_preset(&settings);
            let (preset, ms, frames) = (preset.to_owned(), timings.frame_gpu_ms(), timings.frames().len());
            let choice = Choice { preset, sets, settings, ms, frames, bytes, error };
            // A limit applies to the measured time; settings are compared by the time that other programs disturb
            // least.
            let cpu = timings.frame_cpu_ms().filter(|_| limits.ms.is_none());
            let idle = cpu.and_then(|cpu| self.bench.on_idle(cpu.median)).filter(|ms| *ms > 0.0);
            point.reading = Reading { ms: idle.unwrap_or(ms.median), passes: passes(&timings), bytes, error };
            finals.push((choice, point));
        }
        finals.sort_by(|a, b| limits.score(&a.1.reading).compare(&limits.score(&b.1.reading)));
        Ok(finals)
    }

    /// The errors of settings at all views against one of the two references.
    fn errors(&mut self, settings: &Settings, copy: u64) -> Result<Vec<f64>> {
        self.question.views.iter().map(|seen| Ok(self.bench.reading(settings, seen, copy)?.error)).collect()
    }

    fn worst_error(&mut self, settings: &Settings, copy: u64) -> Result<f64> {
        Ok(self.errors(settings, copy)?.into_iter().fold(0.0, f64::max))
    }

    /// The view at which the error is largest.
    fn worst_view(&mut self, settings: &Settings) -> Result<usize> {
        let errors = self.errors(settings, 0)?;
        let worst = (0..errors.len()).rev().max_by(|a, b| errors[*a].total_cmp(&errors[*b]));
        Ok(worst.expect("there is a view"))
    }

    /// Checks the winner at further views, and makes the answer.
    fn conclude(mut self, chosen: Vec<(Choice, Point)>) -> Result<Answer> {
        let (limits, views) = (self.question.limits, &self.question.views);
        let (mut winner, mut other_seed) = (0, 0.0);
        for (i, (choice, _)) in chosen.iter().enumerate() {
            (self.bench.setup.is_at)("checking against a reference of another seed".into());
            let worst = self.worst_error(&choice.settings, 1)?;
            // Settings that hold a limit only with one reference do not count.
            let lucky = limits.error.is_some_and(|limit| choice.error <= limit && worst > limit);
            if !lucky || i == 0 {
                (winner, other_seed) = (i, worst);
            }
            if !lucky {
                break;
            }
        }
        let (choice, point) = chosen[winner].clone();
        let held_out = self.held_out(&choice.settings)?;
        let noise = views.iter().map(|seen| self.bench.noise(seen)).collect::<Result<Vec<_>>>()?;
        let confidence = Confidence {
            samples: self.bench.samples(),
            noise: noise.into_iter().fold(0.0, f64::max),
            other_seed,
            held_out,
            second_bounce: self.second_bounce()?,
        };
        let worst = Reading { error: point.reading.error.max(other_seed), ..point.reading.clone() };
        let setup = &self.bench.setup;
        Ok(Answer {
            version: VERSION,
            scene: setup.scene.name.clone(),
            device: setup.context.name.clone(),
            driver: setup.context.driver.clone(),
            width: setup.options.size.0,
            height: setup.options.size.1,
            error_width: setup.size.0,
            error_height: setup.size.1,
            error_of: setup.part,
            limits,
            holds: limits.hold(&worst),
            commands: Vec::new(),
            binds: limits.binding(&worst).map(|(limit, share)| Binds { limit: limit.to_owned(), share }),
            passes: shares(&point.reading),
            ladders: self.neighbours(&point, choice.ms.median),
            not_needed: self.not_needed(&choice.settings, limits.hold(&worst), confidence.second_bounce),
            confidence,
            measured: self.search.points.len(),
            measuring_cpu_s: self.bench.spent_cpu_s(),
            finished: self.search.finished,
            finalists: chosen.into_iter().map(|(choice, _)| choice).collect(),
            choice,
        })
    }

    /// Checks as many further views as the budget allows.
    fn held_out(&mut self, settings: &Settings) -> Result<Vec<HeldOut>> {
        let mut checked = Vec::new();
        for seen in &self.question.held_out {
            if Instant::now() + Duration::from_secs_f64(self.bench.reference_s()) > self.after(1.2) {
                break;
            }
            (self.bench.setup.is_at)(format!("checking {}", seen.words));
            match self.bench.reading(settings, seen, 0) {
                Ok(Reading { error, .. }) => {
                    checked.push(HeldOut { view: seen.words.clone(), error, noise: self.bench.noise(seen)? });
                }
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                // Without light, there is no relative error.
                Err(_) => {}
            }
        }
        Ok(checked)
    }

    /// The share of the image's light from a second bounce, from two settings that differ only in bounces.
    fn second_bounce(&mut self) -> Result<Option<f64>> {
        let seen = &self.question.views[self.guide];
        let Self { bench, search, .. } = self;
        for one in search.points.iter().filter(|point| point.ran()) {
            let space = &search.spaces[one.space];
            let ladder = space.ladders.iter().position(|ladder| ladder.key == "bounces");
            let Some(ladder) = ladder.filter(|ladder| one.place[*ladder] == 0) else { continue };
            let two = search.point(one.space, &with_rung(&one.place, ladder, 1)).filter(|two| two.ran());
            let Some(two) = two else { continue };
            let mut light = |point: &Point| {
                let row = bench.row(&space.settings(&point.place), seen)?;
                Ok::<f64, Error>(bench.image(&row).beauty().iter().flatten().map(|v| f64::from(*v)).sum())
            };
            let (one, two) = (light(one)?, light(two)?);
            return Ok((two > 0.0).then(|| (two - one) / two));
        }
        Ok(None)
    }

    fn not_needed(&self, settings: &Settings, holds: bool, second_bounce: Option<f64>) -> Vec<String> {
        let (scene, bounds) = (self.bench.setup.scene, self.bench.setup.options.bounds);
        let mut said = Needs::of_scene(scene).not_needed(scene);
        if holds && settings.method == Method::None {
            said.push("light from other surfaces: direct light alone is accurate enough".into());
        }
        if let Some(share) = second_bounce {
            let bounces = format!("bounces = {}", settings.bounces);
            said.push(format!(
                "of bounces: a second one adds {:.1} % to the image's light ({bounces} was chosen)",
                100.0 * share
            ));
        }
        if let Some(voxels) = warnings::thinnest(scene, &self.question.views[0].pose, bounds, settings) {
            said.push(format!("of the grid: the thinnest wall is {voxels:.1} voxels at {}³", settings.voxels));
        }
        said
    }

    /// The neighbouring rungs of the winner on each ladder. Times of the search are scaled to `ms`, the final time of
    /// the winner.
    fn neighbours(&self, winner: &Point, ms: f64) -> Vec<Neighbours> {
        let search = &self.search;
        let searched = search.point(winner.space, &winner.place);
        let factor = searched.map_or(1.0, |point| ms / point.reading.ms);
        let model = Model::new(search.spaces, &search.points, winner);
        let ladders = &search.spaces[winner.space].ladders;
        let rung = |ladder: usize, rung: Option<usize>| {
            let rung = rung.filter(|rung| *rung < ladders[ladder].rungs.len())?;
            let place = with_rung(&winner.place, ladder, rung);
            let found = search.point(winner.space, &place).filter(|point| point.ran());
            let mut reading = found.map(|point| point.reading.clone()).or_else(|| model.predict(&place))?;
            reading.ms *= factor;
            let (value, holds) = (ladders[ladder].rungs[rung].to_owned(), self.question.limits.hold(&reading));
            let Reading { ms, error, bytes, .. } = reading;
            Some(Neighbour { value, ms, error, bytes, measured: found.is_some(), holds })
        };
        let ladder = |(i, ladder): (usize, &Ladder)| Neighbours {
            key: ladder.key.to_owned(),
            value: ladder.rungs[winner.place[i]].to_owned(),
            down: rung(i, winner.place[i].checked_sub(1)),
            up: rung(i, Some(winner.place[i] + 1)),
        };
        ladders.iter().enumerate().map(ladder).collect()
    }
}

fn shares(reading: &Reading) -> Vec<PassShare> {
    let sum: f64 = reading.passes.values().sum();
    let mut shares: Vec<PassShare> =
        reading.passes.iter().map(|(name, ms)| PassShare { name: name.clone(), share: ms / sum }).collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    shares
}
