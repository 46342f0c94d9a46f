//! The winner checked where nothing was searched, and what is known put into an answer.

use std::time::{Duration, Instant};

use super::Asking;
use crate::chart::row::Part;
use crate::gi::Method;
use crate::plan::VERSION;
use crate::plan::answer::{Answer, Binds, Choice, Confidence, HeldOut, Neighbour, Neighbours, PassShare};
use crate::plan::bench::samples;
use crate::plan::model::Model;
use crate::plan::needs::thinnest_wall;
use crate::plan::search::{Point, Reading};
use crate::plan::space::Ladder;
use crate::settings::Settings;
use crate::{Error, Result};

impl Asking<'_> {
    /// Checks the winner where nothing was searched, and says what is known.
    pub(super) fn conclude(mut self, points: &[Point], chosen: Vec<(Choice, Point)>, finished: bool) -> Result<Answer> {
        let limits = self.question.limits;
        let views = self.question.views.clone();
        let (mut winner, mut other_seed) = (0, 0.0);
        for (i, (choice, _)) in chosen.iter().enumerate() {
            let mut worst = 0.0f64;
            for seen in &views {
                self.host.is_at("checking against a reference of another seed".into());
                worst = worst.max(self.reading_by(&choice.settings, seen, 1)?.error);
            }
            // What holds by the luck of one reference does not hold.
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
        let noise = views.iter().map(|seen| self.bench.noise(seen, self.level)).collect::<Result<Vec<_>>>()?;
        let confidence = Confidence {
            samples: samples(self.level),
            noise: noise.into_iter().fold(0.0, f64::max),
            other_seed,
            held_out,
            second_bounce: self.second_bounce(points)?,
        };
        let mut worst = point.reading.clone();
        worst.error = worst.error.max(other_seed);
        let (scene, context, (error_width, error_height)) =
            (self.question.scene, self.question.context, self.bench.size);
        let (width, height) = self.question.options.size;
        let part = match self.question.part {
            Part::Total => "whole",
            Part::Indirect => "indirect",
            Part::Diffuse => "diffuse",
        };
        Ok(Answer {
            version: VERSION,
            scene: scene.name.clone(),
            device: context.name.clone(),
            driver: context.driver.clone(),
            width,
            height,
            error_width,
            error_height,
            error_of: part.to_owned(),
            limits,
            holds: limits.hold(&worst),
            commands: Vec::new(),
            binds: limits.binding(&worst).map(|(limit, share)| Binds { limit: limit.to_owned(), share }),
            passes: shares(&point.reading),
            ladders: self.neighbours(points, &point, choice.ms.median),
            not_needed: self.not_needed(&choice.settings, limits.hold(&worst), confidence.second_bounce),
            confidence,
            measured: points.len(),
            measuring_cpu_s: self.bench.spent_cpu_s(),
            finished,
            finalists: chosen.into_iter().map(|(choice, _)| choice).collect(),
            choice,
        })
    }

    /// As many as the budget has room for.
    fn held_out(&mut self, settings: &Settings) -> Result<Vec<HeldOut>> {
        let mut checked = Vec::new();
        for seen in &self.question.held_out.clone() {
            let needs = 2.0 * self.pace.unwrap_or(0.0) * f64::from(samples(self.level));
            if Instant::now() + Duration::from_secs_f64(needs) > self.after(1.2) {
                break;
            }
            self.host.is_at(format!("checking {}", seen.words));
            let error = self.reading_by(settings, seen, 0);
            // Where nothing is lit, no error is relative.
            let Ok(Reading { error, .. }) = error else {
                self.host.check()?;
                continue;
            };
            checked.push(HeldOut { view: seen.words.clone(), error, noise: self.bench.noise(seen, self.level)? });
        }
        Ok(checked)
    }

    /// What a second bounce adds, by two places that differ in nothing else.
    fn second_bounce(&mut self, points: &[Point]) -> Result<Option<f64>> {
        let seen = self.question.views[self.guide].clone();
        for one in points.iter().filter(|point| point.ran()) {
            let Some(ladder) = self.spaces[one.space].ladders.iter().position(|ladder| ladder.key == "bounces") else {
                continue;
            };
            let mut place = one.place.clone();
            place[ladder] = 1;
            let two = points.iter().find(|two| two.space == one.space && two.place == place && two.ran());
            let Some(two) = two.filter(|_| one.place[ladder] == 0) else { continue };
            let mut light = |point: &Point| {
                let row = self.bench.row(&self.spaces[point.space].settings(&point.place), &seen)?;
                let sum = |row| self.bench.image(&row).beauty().iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
                Ok::<_, Error>(row.map_or(0.0, sum))
            };
            let (one, two) = (light(one)?, light(two)?);
            return Ok((two > 0.0).then(|| (two - one) / two));
        }
        Ok(None)
    }

    fn not_needed(&self, settings: &Settings, holds: bool, second_bounce: Option<f64>) -> Vec<String> {
        let mut said = self.needs.not_needed(self.question.scene);
        if holds && settings.method == Method::None {
            said.push("light from other surfaces: direct light alone is right enough".into());
        }
        if let Some(share) = second_bounce {
            let bounces = format!("bounces = {}", settings.bounces);
            said.push(format!(
                "of bounces: a second one adds {:.1} % to the image's light ({bounces} was chosen)",
                100.0 * share
            ));
        }
        let (pose, bounds) = (&self.question.views[0].pose, self.question.options.bounds);
        if let Some(wall) = thinnest_wall(self.question.scene, pose, bounds, settings) {
            said.push(format!("of the grid: {wall}"));
        }
        said
    }

    /// Each ladder's rungs beside the winner's. Times of the search are put in proportion to `ms`, the winner's at the end.
    fn neighbours(&self, points: &[Point], winner: &Point, ms: f64) -> Vec<Neighbours> {
        let searched = points.iter().find(|point| point.space == winner.space && point.place == winner.place);
        let factor = searched.map_or(1.0, |point| ms / point.reading.ms);
        let model = Model::new(&self.spaces, points, (winner.space, &winner.place));
        let ladders = &self.spaces[winner.space].ladders;
        let rung = |ladder: usize, rung: Option<usize>| {
            let rung = rung.filter(|rung| *rung < ladders[ladder].rungs.len())?;
            let mut place = winner.place.clone();
            place[ladder] = rung;
            let found = points.iter().find(|point| point.space == winner.space && point.place == place && point.ran());
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
    let sum: f64 = reading.passes.iter().map(|pass| pass.1).sum();
    let mut shares: Vec<PassShare> =
        reading.passes.iter().map(|(name, ms)| PassShare { name: name.clone(), share: ms / sum }).collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    shares
}
