//! A row: a case, a preset and a grid, with its number over all places.

use serde::{Deserialize, Serialize};

use super::case::{Case, Sample};
use crate::lab::store::{self as lab, Kind, Origin};
use crate::measure::timing::Spread;

/// A row. `docs/json.md` lists the keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Hash over everything that determines the row.
    pub key: String,
    /// Hash over everything that determines the row except the device.
    pub address: String,
    pub case: String,
    pub preset: String,
    pub method: String,
    /// Voxels along the grid's edge.
    pub grid: u32,
    /// The command that measures this row again.
    pub command: String,
    /// The measurement; `None` if it could not run.
    pub measured: Option<Measured>,
    /// The reason why it could not run.
    pub failure: Option<String>,
    /// The origin; `None` before the run.
    pub origin: Option<Origin>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The number over all places; a non-finite one counts as [`NOT_FINITE`].
    pub number: Spread,
    /// The largest distance from the ideal over all places.
    pub distance: f64,
    /// The place with that distance, in words.
    pub worst: String,
    /// Every place with its number.
    pub places: Vec<(String, f64)>,
    /// Further numbers, each the median over the places.
    pub more: Vec<(String, f64)>,
    /// Device time of a frame.
    pub frame_gpu_ms: Spread,
    /// Seconds for the whole row, including references that were not in the cache.
    pub seconds: f64,
}

/// Embedded images of the worst place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pictures {
    pub image: String,
    /// The correct image, if it is known.
    pub truth: Option<String>,
}

/// The value that represents a non-finite number, which JSON cannot express.
pub const NOT_FINITE: f64 = 1e9;

impl lab::ExperimentRow for Row {
    type Pictures = Pictures;

    const KIND: Kind = Kind { command: "stability", words: "rows of stability", version: super::VERSION };

    fn key(&self) -> &str {
        &self.key
    }

    fn address(&self) -> &str {
        &self.address
    }

    fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    fn is_measured(&self) -> bool {
        self.measured.is_some()
    }

    fn title(&self) -> String {
        format!("{} {} {}³", self.case, self.preset, self.grid)
    }

    fn lasting(&self) -> serde_json::Value {
        let numbers = |m: &Measured| serde_json::json!([m.number, m.distance, m.worst, m.places, m.more]);
        serde_json::json!([self.failure, self.measured.as_ref().map(numbers)])
    }
}

impl Measured {
    /// `samples` has at least one element. Also returns the worst one.
    pub fn of_samples(case: &Case, samples: &[Sample], frame_ms: &[f64], seconds: f64) -> (Self, usize) {
        let finite = |value: f64| if value.is_finite() { value } else { NOT_FINITE };
        let numbers: Vec<f64> = samples.iter().map(|sample| finite(sample.number)).collect();
        let distance = |i: &usize| (numbers[*i] - case.ideal).abs();
        let worst = (0..numbers.len()).max_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_default();
        let more = samples[0].more.iter().enumerate().map(|(i, (name, _))| {
            let values = samples.iter().map(|sample| finite(sample.more[i].1));
            ((*name).to_owned(), Spread::of_values(values).median)
        });
        let measured = Self {
            number: Spread::of_values(numbers.iter().copied()),
            distance: distance(&worst),
            worst: samples[worst].place.clone(),
            places: samples.iter().map(|sample| sample.place.clone()).zip(numbers.iter().copied()).collect(),
            more: more.collect(),
            frame_gpu_ms: Spread::of_values(frame_ms.iter().copied()),
            seconds,
        };
        (measured, worst)
    }
}
