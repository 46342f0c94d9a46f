//! The answer of `twobounce plan`: the file of `--json`, and the same as text. `docs/json.md` lists the keys.

use serde::{Deserialize, Serialize};

use super::limits::Limits;
use crate::measure::metrics::Part;
use crate::measure::timing::Spread;
use crate::memory::mib;
use crate::settings::Settings;

/// Errors are shares of the mean light, times are milliseconds of device time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// [`super::VERSION`]
    pub version: u32,
    pub scene: String,
    pub device: String,
    pub driver: String,
    /// Width in pixels.
    pub width: u32,
    pub height: u32,
    /// Width in pixels of the images whose errors were measured.
    pub error_width: u32,
    pub error_height: u32,
    /// The part of the light whose error counts.
    pub error_of: Part,
    pub limits: Limits,
    /// Whether `choice` holds the limits; otherwise it is the nearest found.
    pub holds: bool,
    /// One command per view.
    pub commands: Vec<String>,
    pub choice: Choice,
    /// The most exhausted limit and the share of it; `None` without limits.
    pub binds: Option<Binds>,
    /// Shares of passes in the frame's time, the largest first.
    pub passes: Vec<PassShare>,
    pub ladders: Vec<Neighbours>,
    /// Sentences about settings that the scene does not need.
    pub not_needed: Vec<String>,
    pub confidence: Confidence,
    /// The number of settings that were measured, in this call or earlier.
    pub measured: usize,
    /// Seconds of processor time for measuring them, without references and final times; `None` if the system does not
    /// report it.
    pub measuring_cpu_s: Option<f64>,
    /// Whether the search ended by itself, instead of by the budget.
    pub finished: bool,
    /// The best settings in order, which were timed at the end.
    pub finalists: Vec<Choice>,
}

/// Settings with their measurements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    pub preset: String,
    /// `key=value` of the differences from the preset.
    pub sets: Vec<String>,
    pub settings: Settings,
    pub ms: Spread,
    /// The number of frames of the times.
    pub frames: usize,
    pub bytes: u64,
    /// The error against the reference at the worst view: an upper bound, because the reference's noise only adds to
    /// it.
    pub error: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Binds {
    pub limit: String,
    pub share: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassShare {
    pub name: String,
    pub share: f64,
}

/// A setting of the choice and its neighbouring rungs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Neighbours {
    pub key: String,
    pub value: String,
    pub down: Option<Neighbour>,
    pub up: Option<Neighbour>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Neighbour {
    pub value: String,
    pub ms: f64,
    pub error: f64,
    pub bytes: u64,
    /// Whether it was measured, instead of predicted.
    pub measured: bool,
    pub holds: bool,
}

/// Checks of the answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Confidence {
    /// Samples per pixel of the references.
    pub samples: u32,
    /// Upper bound of the references' noise, in units of the error.
    pub noise: f64,
    /// Error of the choice against references of another seed, at the worst view.
    pub other_seed: f64,
    /// Errors at views that were not searched.
    pub held_out: Vec<HeldOut>,
    /// The share of the image's light from the second bounce; `None` if it was not measured.
    pub second_bounce: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    pub view: String,
    pub error: f64,
    /// The noise of its reference.
    pub noise: f64,
}

impl Choice {
    /// The flags for these settings.
    pub fn flags(&self) -> Vec<String> {
        let sets = self.sets.iter().map(|set| format!("--set={set}"));
        std::iter::once(format!("--preset={}", self.preset)).chain(sets).collect()
    }
}

impl Limits {
    /// The limits as text, such as `an error of at most 0.1 and at most 40 ms a frame`.
    pub fn in_words(&self) -> String {
        let error = self.error.map(|error| format!("an error of at most {error}"));
        let ms = self.ms.map(|ms| format!("at most {ms} ms a frame"));
        let bytes = self.bytes.map(|bytes| format!("at most {:.1} MiB", mib(bytes)));
        [error, ms, bytes].into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }
}

impl Answer {
    /// The answer as text.
    pub fn text(&self) -> String {
        let Self { choice, confidence, width, height, .. } = self;
        let mut lines = Vec::new();
        let asked = self.limits.in_words();
        lines.push(match self.holds {
            true => format!("the cheapest of {} settings measured that hold {asked}:\n", self.measured),
            false => format!("none of {} settings measured holds {asked}; the nearest:\n", self.measured),
        });
        lines.extend(self.commands.iter().map(|command| format!("  {command}")));
        let Spread { median, min, max } = choice.ms;
        let spread = format!("{} to {} over {} frames", short(min), short(max), choice.frames);
        let time = format!("time    {} ms a frame from scratch ({spread})", short(median));
        lines.push(format!("\n{time}, {width}x{height}, {}", self.device));
        lines.push(format!("memory  {:.1} MiB", mib(choice.bytes)));
        let (most, noise) = (choice.error, confidence.noise);
        let of = format!("{}, {}x{}", error_words(self.error_of), self.error_width, self.error_height);
        lines.push(format!(
            "error   {most:.4} of {of}: with the noise of the reference, which is {noise:.4} of it; without it between {:.4} and {most:.4}",
            (most - noise).max(0.0)
        ));
        if let Some(Binds { limit, share }) = &self.binds {
            lines.push(format!("binds   {limit}: {:.0} % of it is taken", 100.0 * share));
        }
        let passes = self.passes.iter().take(4).map(|pass| format!("{} {:.0} %", pass.name, 100.0 * pass.share));
        lines.push(format!("passes  {}", passes.collect::<Vec<_>>().join(", ")));
        lines.push("\nthe next rungs (~ concluded, not measured):".into());
        let cell = |rung: &Option<Neighbour>| {
            let Some(Neighbour { value, ms, error, measured, holds, .. }) = rung else { return "–".to_owned() };
            let (about, holds) = (if *measured { "" } else { "~" }, if *holds { "" } else { ", does not hold" });
            format!("{value}: {about}{} ms, error {about}{error:.4}{holds}", short(*ms))
        };
        for Neighbours { key, value, down, up } in &self.ladders {
            lines.push(format!("  {key} = {value}; down {}; up {}", cell(down), cell(up)));
        }
        if !self.not_needed.is_empty() {
            lines.push("\nwhat the scene does not need, and why:".into());
            lines.extend(self.not_needed.iter().map(|sentence| format!("  {sentence}")));
        }
        lines.push("\nhow sure it is:".into());
        lines.push(format!(
            "  against a reference of another seed ({} samples a pixel each) the error is {:.4}",
            confidence.samples, confidence.other_seed
        ));
        for HeldOut { view, error, noise } in &confidence.held_out {
            let holds = match self.limits.error {
                Some(limit) if *error > limit => ", which does not hold",
                Some(_) => ", which holds",
                None => "",
            };
            lines.push(format!("  {view}, which was not searched: error {error:.4} (noise {noise:.4}){holds}"));
        }
        if confidence.held_out.is_empty() {
            lines.push("  no other view was checked: the budget was spent".into());
        }
        let others = self.finalists.iter().filter(|other| *other != choice);
        let others: Vec<String> = others
            .map(|other| format!("{} ms, {:.4} ({})", short(other.ms.median), other.error, other.flags().join(" ")))
            .collect();
        if !others.is_empty() {
            lines.push(format!("  timed beside it, in turns: {}", others.join("; ")));
        }
        if !self.finished {
            lines.push("  the budget was spent before the search was done: a larger --budget may find better".into());
        }
        lines.join("\n") + "\n"
    }
}

/// The part of the light as text.
fn error_words(part: Part) -> &'static str {
    match part {
        Part::Total => "the image's light",
        Part::Indirect => "the indirect light",
        Part::Diffuse => "the indirect light on diffuse surfaces",
    }
}

/// A time with three digits.
fn short(ms: f64) -> String {
    let digits = if ms > 0.0 { (2 - ms.log10().floor() as i32).clamp(0, 3) } else { 0 };
    format!("{ms:.*}", digits as usize)
}
