//! The subject of a row: settings of the renderer, the path tracer along a number of paths, or an image of another program.

use serde::{Deserialize, Serialize};

use super::import::{Claim, Import};
use super::measure::{ChartScene, same_depth};
use super::plan::Trial;
use crate::measure::terms::Subtract;
use crate::reference::Depth;

/// A subject that is to become a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Subject {
    Settings(Trial),
    /// The path tracer along so many paths a pixel.
    Paths(u32),
    Import(Import),
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
    Import(Claim),
}

impl Source {
    /// In a word, for tables.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Settings => "settings",
            Self::PathTracer { .. } => "path-tracer",
            Self::Import(_) => "import",
        }
    }
}

impl Subject {
    /// Its name in a chart.
    pub fn name(&self) -> String {
        match self {
            Self::Settings(trial) => trial.name(),
            Self::Paths(1) => "1 path a pixel".to_owned(),
            Self::Paths(paths) => format!("{paths} paths a pixel"),
            Self::Import(import) => import.name.clone(),
        }
    }

    pub fn source(&self) -> Source {
        match self {
            Self::Settings(_) => Source::Settings,
            Self::Paths(paths) => Source::PathTracer { paths: *paths },
            Self::Import(import) => Source::Import(import.claim.clone()),
        }
    }

    /// Whether a chart has it for a scene of this name.
    pub fn is_of(&self, scene: &str) -> bool {
        match self {
            Self::Import(import) => import.scene.as_deref().is_none_or(|name| name == scene),
            _ => true,
        }
    }

    /// Everything that determines its row beside the scene.
    pub fn identity(&self) -> serde_json::Value {
        match self {
            Self::Settings(trial) => trial.settings.to_toml().into(),
            Self::Paths(paths) => serde_json::json!(["paths", paths, super::paths::SEED]),
            Self::Import(import) => import.identity(),
        }
    }

    /// The depths of the references that its image is compared with: all light, and as many bounces.
    pub fn depths(&self, scene: &ChartScene) -> [Depth; 2] {
        let same = match self {
            Self::Settings(trial) => same_depth(&scene.scene, &trial.settings),
            Self::Paths(_) => Depth::Full,
            Self::Import(import) => import.depth(scene),
        };
        [Depth::Full, same]
    }

    /// Whose direct light is subtracted to leave the indirect light; `None` where that is not judged.
    pub fn subtract(&self, scene: &ChartScene) -> Option<Subtract> {
        match self {
            Self::Import(import) => import.subtract(scene),
            _ => Some(Subtract::in_scene(&scene.scene)),
        }
    }
}
