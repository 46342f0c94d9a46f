//! A cell of the table: runs a case with a preset on a grid.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::SIZE;
use super::case::{Case, Pixels, Place, Sample};
use super::row::{Measured, Pictures, Row};
use super::stage::Stage;
use crate::Result;
use crate::chart::picture;
use crate::measure::refuse_invalid;
use crate::output::display::{Display, ToneMap};
use crate::output::picture::codes;
use crate::reference::cache::Cache;
use crate::reference::film::Film;
use crate::reference::{Depth, Options, Stop};
use crate::scene::{Pose, Still};
use crate::settings::Settings;
use crate::vk::Context;

/// The effort for a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Effort {
    /// The number of places in the grid; a multiple of three, so that each angle occurs equally often.
    pub places: usize,
    /// Steps of a motion.
    pub steps: usize,
    /// Samples per pixel of references.
    pub samples: u32,
    /// The number of random scenes.
    pub seeds: u64,
}

impl Effort {
    pub const FULL: Self = Self { places: 9, steps: 8, samples: 256, seeds: 24 };
    /// The effort of `--quick`.
    pub const QUICK: Self = Self { places: 2, steps: 3, samples: 32, seeds: 12 };
}

/// The inputs of a row.
#[derive(Clone)]
pub struct Cell<'a> {
    pub context: &'a Arc<Context>,
    pub cache: &'a Cache,
    /// The settings of the preset with the grid's edge.
    pub settings: Settings,
    pub effort: Effort,
    /// Maximum bytes of device memory.
    pub memory_limit: Option<u64>,
    /// Ends the row soon after it is set.
    pub cancel: &'a AtomicBool,
    /// Milliseconds of every frame of the row; clones share them.
    pub frame_ms: Rc<RefCell<Vec<f64>>>,
}

/// The settings of a preset on a grid. The grids of light propagation and of probes keep their proportion to the base
/// grid.
pub fn settings(preset: &str, grid: u32) -> Result<Settings> {
    let mut settings = Settings::preset(preset)?;
    settings.of.lpv.edge = (settings.of.lpv.edge * grid / 64).clamp(16, 64);
    settings.of.probes.edge = (settings.of.probes.edge * grid / 64).clamp(4, 16);
    settings.set(&format!("voxels={grid}"))?;
    Ok(settings)
}

impl Cell<'_> {
    /// Runs a case and fills in its row.
    ///
    /// # Errors
    /// Too little memory, a lost device, or [`Error::Interrupted`](crate::Error::Interrupted).
    pub fn run(&self, case: &Case, row: &Row) -> Result<(Row, Pictures)> {
        let start = Instant::now();
        let samples = case.run(self)?;
        refuse_invalid(self.context)?;
        let seconds = start.elapsed().as_secs_f64();
        let (measured, worst) = Measured::of_samples(case, &samples, &self.frame_ms.borrow(), seconds);
        let Sample { image, truth, .. } = &samples[worst];
        let display = Display::automatic(ToneMap::default(), truth.as_ref().unwrap_or(image));
        let uri = |pixels: &Pixels| picture::uri((SIZE, SIZE), codes(pixels, display));
        let pictures = Pictures { image: uri(image), truth: truth.as_ref().map(uri) };
        Ok((Row { measured: Some(measured), ..row.clone() }, pictures))
    }

    /// Places with three angles.
    pub fn turned_places(&self) -> Vec<Place> {
        Place::all(self.effort.places, true)
    }

    /// A copy of the cell with one setting changed.
    pub fn with(&self, assignment: &str) -> Result<Self> {
        let mut cell = self.clone();
        cell.settings.set(assignment)?;
        Ok(cell)
    }

    /// A path-traced image. If scene and view are moved together, it is the same.
    pub fn film(&self, stage: &Stage, pose: &Pose, depth: Depth, seed: u64) -> Result<Film> {
        let stop = Stop::Samples(self.effort.samples);
        let options = Options { width: SIZE, height: SIZE, depth, stop, seed, occlusion: false };
        self.cache.render(Still::new(&stage.scene, pose, &stage.view), &options, &|_| {}, self.cancel)
    }
}
