//! One setting on one scene: its times and errors, or why it could not run.

use serde::{Deserialize, Serialize};

use super::plan::Trial;
use crate::measure::metrics::{Metrics, NoiseInRel};
use crate::measure::timing::Spread;
use crate::settings::Settings;

/// One setting on one scene. `docs/json.md` lists the keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Hash over everything that determines the row.
    pub key: String,
    /// Hash over the same but the device: shards and merged charts know a row of any machine by it.
    pub address: String,
    /// The scene's name in this chart.
    pub scene: String,
    /// The preset and what was swept, in one line.
    pub name: String,
    pub preset: String,
    /// `key=value` of the sweep; empty for a preset by itself.
    pub swept: Vec<String>,
    /// `key=value` for every setting that differs from the preset.
    pub changes: Vec<String>,
    pub settings: Settings,
    /// Absent where the setting could not run.
    pub measured: Option<Measured>,
    /// Why it could not.
    pub failure: Option<String>,
    /// Absent until it ran.
    pub origin: Option<Origin>,
}

/// Where and when a row was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// `--machine`, or the host's name.
    pub machine: String,
    pub device: String,
    pub driver: String,
    /// The program's version.
    pub program: String,
    /// The first digits of the hash of the program's file.
    pub build: String,
    /// `--label`.
    pub label: Option<String>,
    /// Seconds since 1970, UTC.
    pub unix_s: u64,
}

impl Origin {
    /// Whose times may be compared: those of one device in one machine.
    pub fn place(&self) -> [&str; 3] {
        [&self.machine, &self.device, &self.driver]
    }
}

/// Times in milliseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Frames that the times are taken over; one before them warmed up.
    pub frames: usize,
    /// Device time from a frame's first timestamp to its last.
    pub frame_gpu_ms: Spread,
    /// Processor time of the whole process over all threads, where the system tells it.
    pub frame_cpu_ms: Option<Spread>,
    /// From the start of recording to the end of the wait.
    pub frame_wall_ms: Spread,
    /// In the order of the frame.
    pub passes: Vec<Pass>,
    /// Bytes of device memory, as planned and taken.
    pub memory_bytes: u64,
    /// Values of the image that are NaN or infinite.
    pub nonfinite: usize,
    /// The settings that were changed for the image on which the indirect light was measured, as `key=value`; empty where it is
    /// the image of the row's own settings. See [`crate::measure::terms`].
    pub equal_terms: Vec<String>,
    /// Against all of the light.
    pub full: Errors,
    /// Against light of as many bounces as the settings ask for.
    pub same: Errors,
}

/// A pass's median.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    pub name: String,
    pub gpu_ms: f64,
}

/// Against one reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// The reference's indirect bounces; absent: all.
    pub bounces: Option<u32>,
    /// The reference's own noise: root mean square of its pixels' relative error.
    pub noise: f64,
    /// What that may add to `rel`.
    pub noise_in_rel: NoiseInRel,
    pub total: Metrics,
    /// Mean LDR-FLIP of the whole.
    pub flip: f64,
    /// Of the indirect light, on equal terms; absent where the reference has none.
    pub indirect: Option<Metrics>,
    /// Of that over the pixels in which the reference shows diffuse surfaces alone; absent where there are none or no indirect
    /// light reaches them.
    pub diffuse: Option<Metrics>,
}

/// Which reference an image is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// All light.
    Full,
    /// Light of as many bounces as the settings ask for.
    Same,
}

/// Which part of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Total,
    Indirect,
    /// Indirect, of pixels that show diffuse surfaces alone.
    Diffuse,
}

impl Row {
    /// A setting on a scene without a result yet.
    pub fn new(key: String, scene: &str, trial: &Trial) -> Self {
        let Trial { preset, swept, settings } = trial.clone();
        let changes = trial.changes().into_iter().map(|(key, value)| format!("{}={value}", key.name)).collect();
        let (scene, name, address) = (scene.to_owned(), trial.name(), String::new());
        let (measured, failure, origin) = (None, None, None);
        Self { key, address, scene, name, preset, swept, changes, settings, measured, failure, origin }
    }

    /// Whether both references have at most this noise.
    pub fn is_within(&self, noise: f64) -> bool {
        self.measured.as_ref().is_some_and(|m| m.full.noise <= noise && m.same.noise <= noise)
    }

    /// Whose times may be compared with this row's.
    pub fn place(&self) -> Option<[&str; 3]> {
        self.origin.as_ref().map(Origin::place)
    }

    /// `rel`, where it was measured and the reference has this part of the light.
    pub fn rel(&self, reference: Reference, part: Part) -> Option<f64> {
        let errors = self.errors(reference)?;
        let metrics = match part {
            Part::Total => Some(errors.total),
            Part::Indirect => errors.indirect,
            Part::Diffuse => errors.diffuse,
        };
        Some(metrics?.rel)
    }

    /// What the reference's noise may have added to [`Self::rel`].
    pub fn noise_in_rel(&self, reference: Reference, part: Part) -> Option<f64> {
        let noise = self.errors(reference)?.noise_in_rel;
        match part {
            Part::Total => Some(noise.total),
            Part::Indirect => noise.indirect,
            Part::Diffuse => noise.diffuse,
        }
    }

    fn errors(&self, reference: Reference) -> Option<&Errors> {
        let measured = self.measured.as_ref()?;
        Some(match reference {
            Reference::Full => &measured.full,
            Reference::Same => &measured.same,
        })
    }

    /// Median device time of a frame in milliseconds, where it was measured.
    pub fn gpu_ms(&self) -> Option<f64> {
        self.measured.as_ref().map(|m| m.frame_gpu_ms.median)
    }
}
