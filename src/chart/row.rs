//! One setting on one scene: its times and errors, or why it could not run.

use serde::{Deserialize, Serialize};

use super::measure::ChartScene;
use super::subject::{Source, Subject};
use crate::lab::store::{self as lab, Kind, Origin, device_words, short_hash};
use crate::measure::metrics::{Metrics, NoiseInRel};
use crate::measure::timing::Spread;
use crate::reference::{Depth, Stop, cache};
use crate::scene::Still;
use crate::settings::Settings;
use crate::vk::Context;

/// One setting on one scene. `docs/json.md` lists the keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Hash over everything that determines the row.
    pub key: String,
    /// Hash over the same but the device: shards and merged charts know a row of any machine by it.
    pub address: String,
    /// The scene's name in this chart.
    pub scene: String,
    /// The preset and what was swept, in one line; of other images how they are called.
    pub name: String,
    /// The maker of the image.
    #[serde(default)]
    pub source: Source,
    /// Empty without settings.
    pub preset: String,
    /// `key=value` of the sweep; empty for a preset by itself.
    pub swept: Vec<String>,
    /// `key=value` for every setting that differs from the preset.
    pub changes: Vec<String>,
    /// Absent where the image is not the renderer's.
    pub settings: Option<Settings>,
    /// Absent where the setting could not run.
    pub measured: Option<Measured>,
    /// Why it could not.
    pub failure: Option<String>,
    /// Absent until it ran, and where the image is another program's.
    pub origin: Option<Origin>,
}

/// Times in milliseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Frames that the times are taken over, after those that warmed up; 0 where no time was measured.
    pub frames: usize,
    /// Device time from a frame's first timestamp to its last; absent where no device made the image.
    pub frame_gpu_ms: Option<Spread>,
    /// Processor time of the whole process over all threads, where the system tells it.
    pub frame_cpu_ms: Option<Spread>,
    /// From the start of recording to the end of the wait; of the path tracer, of a trace.
    pub frame_wall_ms: Option<Spread>,
    /// In the order of the frame.
    pub passes: Vec<Pass>,
    /// Bytes of device memory, as planned and taken.
    pub memory_bytes: Option<u64>,
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

impl lab::Row for Row {
    type Pictures = Pictures;

    const KIND: Kind = Kind { command: "chart", words: "a chart", version: super::VERSION };

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
        format!("{} {}", self.scene, self.name)
    }

    fn lasting(&self) -> serde_json::Value {
        let numbers = |m: &Measured| (m.memory_bytes, m.nonfinite, m.equal_terms.clone(), m.full, m.same);
        serde_json::json!([self.settings, self.source, self.failure, self.measured.as_ref().map(numbers)])
    }

    fn noise(&self) -> f64 {
        self.measured.as_ref().map_or(f64::INFINITY, |m| m.full.noise.max(m.same.noise))
    }
}

impl Row {
    /// The subject as a row of a scene, without a result yet.
    pub fn new(key: String, scene: &str, subject: &Subject) -> Self {
        let (scene, name, address) = (scene.to_owned(), subject.name(), String::new());
        let (preset, swept, settings, changes) = match subject {
            Subject::Settings(trial) => {
                let changes = trial.changes().into_iter().map(|(key, value)| format!("{}={value}", key.name)).collect();
                (trial.preset.clone(), trial.swept.clone(), Some(trial.settings.clone()), changes)
            }
            Subject::Paths(_) | Subject::Import(_) => (String::new(), Vec::new(), None, Vec::new()),
        };
        let (source, measured, failure, origin) = (subject.source(), None, None, None);
        Self { key, address, scene, name, source, preset, swept, changes, settings, measured, failure, origin }
    }

    /// Whether two rows are of the same thing, maybe at different times.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let is_same = match (&self.settings, &other.settings) {
            (Some(own), Some(others)) => own.means_same(others),
            (None, None) => self.name == other.name && self.source.word() == other.source.word(),
            _ => false,
        };
        is_same && self.scene == other.scene
    }

    /// Paths a pixel, where the path tracer made the image.
    pub fn paths(&self) -> Option<u32> {
        if let Source::PathTracer { paths } = &self.source { Some(*paths) } else { None }
    }

    /// Whether both references have at most this noise.
    pub fn is_within(&self, noise: f64) -> bool {
        self.measured.as_ref().is_some_and(|m| m.full.noise <= noise && m.same.noise <= noise)
    }

    /// Whose times may be compared with this row's; `None` for a time that was given: it stands beside those of every
    /// place.
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

    /// Milliseconds of a frame, where there is an error to go with it: median device time, the path tracer's median
    /// wall time, or the time that was given.
    pub fn ms(&self) -> Option<f64> {
        let measured = self.measured.as_ref()?;
        match &self.source {
            Source::Settings => Some(measured.frame_gpu_ms?.median),
            Source::PathTracer { .. } => Some(measured.frame_wall_ms?.median),
            Source::Import(claim) => Some(claim.milliseconds),
        }
    }
}

/// A setting's pictures as URIs that hold them, small enough for a page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pictures {
    pub image: String,
    /// Signed difference from the full light, and from that of as many bounces; red is too bright, blue too dark.
    pub full: String,
    pub same: String,
}

/// Names rows after everything that determines them except the program.
pub struct Keys {
    /// The device, validation.
    common: [String; 2],
    noise: f64,
}

impl Keys {
    /// `noise`: a share, not a percentage.
    pub fn new(context: &Context, validation: bool, noise: f64) -> Self {
        Self { common: [device_words(context), validation.to_string()], noise }
    }

    /// Hash over the device and the address; of an image of another program, which needs no device, over the address alone.
    pub fn key(&self, address: &str, subject: &Subject) -> String {
        match subject {
            Subject::Import(_) => short_hash(&serde_json::json!([address])),
            Subject::Settings(_) | Subject::Paths(_) => short_hash(&serde_json::json!([self.common, address])),
        }
    }

    /// Hash over the scene as it is seen, the noise of references, and the settings, or what else made the image.
    pub fn address(&self, scene: &ChartScene, subject: &Subject) -> String {
        let seen = scene.reference_options(Depth::Full, Stop::Noise(self.noise));
        let seen = cache::key(Still::new(&scene.scene, &scene.pose, &scene.view), &seen).to_string();
        let bounds = format!("{:?}", scene.options.bounds);
        short_hash(&serde_json::json!([self.noise.to_string(), seen, bounds, subject.identity()]))
    }
}
