//! A setting on a scene with its times and errors, or the reason why it could not run.

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

/// A row: one setting on one scene. `docs/json.md` lists the keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Hash over everything that determines the row.
    pub key: String,
    /// Hash over everything that determines the row except the device: shards and merged charts identify rows by it.
    pub address: String,
    /// The scene's name in this chart. For a row that is not yet placed, the only scene that it applies to, or empty
    /// for all scenes.
    pub scene: String,
    /// The preset and the swept values in one line; for other images their name.
    pub name: String,
    #[serde(default)]
    pub source: Source,
    /// The preset; empty without settings.
    pub preset: String,
    /// `key=value` of the sweep; empty for a preset by itself.
    pub swept: Vec<String>,
    /// `key=value` for every setting that differs from the preset.
    pub changes: Vec<String>,
    /// The settings; `None` for images of other programs and of the path tracer.
    pub settings: Option<Settings>,
    /// The measurement; `None` if the setting could not run.
    pub measured: Option<Measured>,
    /// The reason why it could not run.
    pub failure: Option<String>,
    /// The origin; `None` before the run, and for images of other programs.
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
        /// Paths per pixel.
        paths: u32,
    },
    /// Another program.
    Import(Box<Claim>),
}

/// Times in milliseconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The number of timed frames after the warm-up; 0 without times.
    pub frames: usize,
    /// Device time from a frame's first timestamp to its last; `None` if no device made the image.
    pub frame_gpu_ms: Option<Spread>,
    /// Processor time of the whole process over all threads, if the system reports it.
    pub frame_cpu_ms: Option<Spread>,
    /// Time from the start of recording to the end of the wait; for the path tracer that of a trace.
    pub frame_wall_ms: Option<Spread>,
    /// Passes in the order of the frame.
    pub passes: Vec<Pass>,
    /// Bytes of device memory, as planned and allocated.
    pub memory_bytes: Option<u64>,
    /// Values of the image that are NaN or infinite.
    pub nonfinite: usize,
    /// The changed settings of the image on which the indirect light was measured, as `key=value`; empty if it has the
    /// row's own settings. See [`crate::measure::terms`].
    pub equal_terms: Vec<String>,
    /// Errors against all light.
    pub full: Errors,
    /// Errors against light of as many bounces as the settings have.
    pub same: Errors,
}

/// The median time of a pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    pub name: String,
    pub gpu_ms: f64,
}

/// Errors against one reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// The reference's indirect bounces; `None` for all.
    pub bounces: Option<u32>,
    /// The reference's own noise: root mean square of its pixels' relative error.
    pub noise: f64,
    /// The error that this noise may add to `rel`.
    pub noise_in_rel: Parts<f64>,
    /// Metrics of each part of the light; indirect light is on equal terms.
    #[serde(flatten)]
    pub metrics: Parts<Metrics>,
    /// Mean LDR-FLIP of the whole image.
    pub flip: f64,
}

/// The reference of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// All light.
    Full,
    /// Light of as many bounces as the settings have.
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
    /// Settings on top of a preset, without a scene or a result. For a base that is not a preset, all differences from
    /// the default preset are shown.
    pub fn of_settings(preset: &str, swept: &[String], settings: Settings) -> Self {
        let name = [&[preset.to_owned()], swept].concat().join(" ");
        let changes = settings.changes_from(&Settings::preset(preset).unwrap_or_default());
        let (preset, swept) = (preset.to_owned(), swept.to_vec());
        Self { name, preset, swept, changes, settings: Some(settings), ..Self::default() }
    }

    /// The path tracer with `paths` paths per pixel.
    pub fn of_paths(paths: u32) -> Self {
        let name = if paths == 1 { "1 path a pixel".to_owned() } else { format!("{paths} paths a pixel") };
        Self { name, source: Source::PathTracer { paths }, ..Self::default() }
    }

    /// The row in a scene, with its hashes over everything that determines it except the program. `noise` is that of
    /// the references as a share, and `common` names the device and whether it is validated.
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
            // An image of another program does not depend on a device.
            Source::Import(_) => short_hash(&json!([address])),
            _ => short_hash(&json!([common, address])),
        };
        Self { key, address, scene: scene.name.clone(), ..self.clone() }
    }

    /// The depths of its references: all light, and as many bounces.
    pub fn depths(&self, scene: &ChartScene) -> [Depth; 2] {
        let same = match (&self.source, &self.settings) {
            (Source::Settings, Some(settings)) => same_depth(&scene.scene, settings),
            (Source::Import(claim), _) => claim.depth(scene),
            _ => Depth::Full,
        };
        [Depth::Full, same]
    }

    /// The image whose direct light is subtracted to leave the indirect light; `None` if that is not judged.
    pub fn subtract(&self, scene: &ChartScene) -> Option<Subtract> {
        match &self.source {
            Source::Import(claim) => claim.subtract(scene),
            _ => Some(Subtract::in_scene(&scene.scene)),
        }
    }

    /// Whether two rows have the same inputs, possibly at different times.
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

    /// Paths per pixel, if the path tracer made the image.
    pub fn paths(&self) -> Option<u32> {
        if let Source::PathTracer { paths } = &self.source { Some(*paths) } else { None }
    }

    /// The place of measurement: times of one place are comparable. `None` for a stated time, which is shown with those
    /// of every place.
    pub fn place(&self) -> Option<[&str; 3]> {
        self.origin.as_ref().map(Origin::place)
    }

    /// `rel`, if it was measured and the reference has this part of the light.
    pub fn rel(&self, reference: Reference, part: Part) -> Option<f64> {
        Some(self.errors(reference)?.metrics.of_part(part)?.rel)
    }

    /// The error that the reference's noise may have added to [`Self::rel`].
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

    /// Milliseconds of a frame, if there is an error: median device time, the path tracer's median wall time, or the
    /// stated time.
    pub fn ms(&self) -> Option<f64> {
        let measured = self.measured.as_ref()?;
        match &self.source {
            Source::Settings => Some(measured.frame_gpu_ms?.median),
            Source::PathTracer { .. } => Some(measured.frame_wall_ms?.median),
            Source::Import(claim) => Some(claim.milliseconds),
        }
    }
}

/// A row's pictures as URIs, small enough for a page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pictures {
    pub image: String,
    /// Signed differences from the full light, and from that of as many bounces; red is too bright, blue too dark.
    pub full: String,
    pub same: String,
}
