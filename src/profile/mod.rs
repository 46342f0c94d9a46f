//! Costs of a frame: the time of each pass per unit of its work, bytes read in an instrumented frame compared with the
//! device's copy rate, statistics of the driver's programs, and the growth of times. `twobounce profile` shows them.

pub mod audit;
pub mod copy;
pub mod costs;
pub mod counts;
pub mod executables;
pub mod growth;
pub mod plot;

use std::sync::Arc;

use crate::Result;
use crate::ground::memory_plan::MemoryPlan;
use crate::measure::timing::{Count, Timings};
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::{Pose, Scene, View};
use crate::settings::Settings;
use crate::vk::Context;
use counts::Counts;

/// A frame that is rendered many times, each time from scratch.
#[derive(Clone)]
pub struct RepeatedFrame<'a> {
    pub scene: &'a Scene,
    pub pose: &'a Pose,
    pub view: &'a View,
    pub settings: Settings,
    pub options: RenderOptions,
    /// A function that is called before every frame; its error ends the run.
    pub check: fn() -> Result<()>,
}

/// The result of repeated frames.
pub struct Run {
    pub timings: Timings,
    pub plan: MemoryPlan,
    /// Bytes allocated from the driver after the last frame.
    pub allocated_bytes: u64,
}

/// The number of warm-up frames: the first one compiles most shaders and grows buffers, and the second one compiles the
/// passes that empty cells of the previous frame.
pub const WARM_UP: u32 = 2;

impl RepeatedFrame<'_> {
    /// Renders `frames` timed frames.
    pub fn run(&self, context: &Arc<Context>, frames: u32) -> Result<Run> {
        let mut renderer = self.renderer(context)?;
        let frames = frames as usize;
        let count = Count { warm_up: WARM_UP as usize, least: frames, most: frames, enough_ms: 0.0 };
        let timings = count.frames(&mut renderer, self.pose, self.view, &self.check)?;
        Ok(Run { timings, plan: renderer.plan(), allocated_bytes: context.allocated_bytes() })
    }

    /// Counts of each pass of a frame; `context` from [`Context::counting`].
    pub fn count(&self, context: &Arc<Context>) -> Result<Vec<(&'static str, Counts)>> {
        let mut renderer = self.renderer(context)?;
        (self.check)()?;
        let report = renderer.render(self.pose, self.view)?;
        // An image in bands has a zone of each pass per band.
        let mut counted: Vec<(&'static str, Vec<u64>)> = Vec::new();
        for zone in report.timings.zones {
            match counted.iter_mut().find(|row| row.0 == zone.name) {
                Some(row) => row.1.iter_mut().zip(zone.counts).for_each(|(sum, count)| *sum += count),
                None => counted.push((zone.name, zone.counts)),
            }
        }
        Ok(counted.into_iter().map(|(name, counts)| (name, Counts::of_counters(&counts))).collect())
    }

    fn renderer(&self, context: &Arc<Context>) -> Result<Renderer> {
        Renderer::new(context, self.scene.clone(), self.pose, self.settings.clone(), self.options.clone())
    }
}
