//! One setting on one scene: its times and errors, or why it could not run.

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::import::Claim;
use super::measure::{ChartScene, SEED, same_depth};
use crate::lab::store::{self as lab, Kind, Origin, short_hash};
use crate::measure::metrics::{Metrics, Part, Parts};
use crate::measure::terms::Subtract;
use crate::measure::timing::Spread;
use crate::reference::{Depth, Stop, cache};
use crate::settings::Settings;

/// One setting on one scene. `docs/json.md` lists the keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Hash over everything that determines the row.
    pub key: String,
    /// Hash over the same but the device: shards and merged charts know a row of any machine by it.
    pub address: String,
    /// The scene's name in this chart. A row that is not placed yet names the only scene that it is for, or none if it
    /// is for all.
    pub scene: String,
    /// The preset and what was swept, in one line; of other images how they are called.
    pub name: String,
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

/// The maker of a row's image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Source {
    /// The renderer with the row's settings.
    #[default]
    Settings,
    /// This program's path tracer.
    PathTracer {
        /// A pixel.
        paths: u32,
    },
    /// Another program.
    Import(Box<Claim>),
}

/// Times in milliseconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// The settings that were changed for the image on which the indirect light was measured, as `key=value`; empty
    /// where it is the image of the row's own settings. See [`crate::measure::terms`].
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// The reference's indirect bounces; absent: all.
    pub bounces: Option<u32>,
    /// The reference's own noise: root mean square of its pixels' relative error.
    pub noise: f64,
    /// Error that this noise may add to `rel`.
    pub noise_in_rel: Parts<f64>,
    /// Of the indirect light, on equal terms.
    #[serde(flatten)]
    pub metrics: Parts<Metrics>,
    /// Mean LDR-FLIP of the whole.
    pub flip: f64,
}

/// Which reference an image is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// All light.
    Full,
    /// Light of as many bounces as the settings ask for.
    Same,
}

impl lab::ExperimentRow for Row {
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
    /// Settings on top of a preset, without a scene and a result yet. A base that is no preset shows all that differs
    /// from the default one.
    pub fn of_settings(preset: &str, swept: &[String], settings: Settings) -> Self {
        let name = [&[preset.to_owned()], swept].concat().join(" ");
        let changes = settings.changes_from(&Settings::preset(preset).unwrap_or_default());
        let (preset, swept) = (preset.to_owned(), swept.to_vec());
        Self { name, preset, swept, changes, settings: Some(settings), ..Self::default() }
    }

    /// The path tracer along so many paths a pixel.
    pub fn of_paths(paths: u32) -> Self {
        let name = if paths == 1 { "1 path a pixel".to_owned() } else { format!("{paths} paths a pixel") };
        Self { name, source: Source::PathTracer { paths }, ..Self::default() }
    }

    /// Itself in a scene, with its hashes over everything that determines it except the program. `noise`: of
    /// references, a share; `common`: the device and whether it is validated.
    pub fn in_scene(&self, scene: &ChartScene, noise: f64, common: &[String; 2]) -> Self {
        let seen = cache::key(scene.still(), &scene.reference_options(Depth::Full, Stop::Noise(noise))).to_string();
        let bounds = format!("{:?}", scene.options.bounds);
        let identity = match &self.source {
            Source::Settings => self.settings.as_ref().map(Settings::to_toml).into(),
            Source::PathTracer { paths } => json!(["paths", paths, SEED]),
            Source::Import(claim) => json!(["import", self.name, claim, claim.files.hash, claim.files.bounces]),
        };
        let address = short_hash(&json!([noise.to_string(), seen, bounds, identity]));
        let key = match self.source {
            // An image of another program needs no device.
            Source::Import(_) => short_hash(&json!([address])),
            _ => short_hash(&json!([common, address])),
        };
        Self { key, address, scene: scene.name.clone(), ..self.clone() }
    }

    /// The depths of the references that the image is compared with: all light, and as many bounces.
    pub fn depths(&self, scene: &ChartScene) -> [Depth; 2] {
        let same = match (&self.source, &self.settings) {
            (Source::Settings, Some(settings)) => same_depth(&scene.scene, settings),
            (Source::Import(claim), _) => claim.depth(scene),
            _ => Depth::Full,
        };
        [Depth::Full, same]
    }

    /// The image of which the direct light is subtracted to leave the indirect light; `None` where that is not judged.
    pub fn subtract(&self, scene: &ChartScene) -> Option<Subtract> {
        match &self.source {
            Source::Import(claim) => claim.subtract(scene),
            _ => Some(Subtract::in_scene(&scene.scene)),
        }
    }

    /// Whether two rows are of the same thing, maybe at different times.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let is_same = match (&self.settings, &other.settings) {
            (Some(own), Some(others)) => own.means_same(others),
            (None, None) => self.name == other.name && self.is_import() == other.is_import(),
            _ => false,
        };
        is_same && self.scene == other.scene
    }

    pub fn is_import(&self) -> bool {
        matches!(self.source, Source::Import(_))
    }

    /// Paths a pixel, where the path tracer made the image.
    pub fn paths(&self) -> Option<u32> {
        if let Source::PathTracer { paths } = &self.source { Some(*paths) } else { None }
    }

    /// The place of measurement: times of one place may be compared. `None` for a time that was given: it stands
    /// beside those of every place.
    pub fn place(&self) -> Option<[&str; 3]> {
        self.origin.as_ref().map(Origin::place)
    }

    /// `rel`, where it was measured and the reference has this part of the light.
    pub fn rel(&self, reference: Reference, part: Part) -> Option<f64> {
        Some(self.errors(reference)?.metrics.of_part(part)?.rel)
    }

    /// Error that the reference's noise may have added to [`Self::rel`].
    pub fn noise_in_rel(&self, reference: Reference, part: Part) -> Option<f64> {
        self.errors(reference)?.noise_in_rel.of_part(part)
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
