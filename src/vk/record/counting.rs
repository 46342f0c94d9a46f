//! Counts of counting shaders (`glsl/common/count.glsl`) for each zone.

use super::recorder::Recorder;
use crate::Result;
use crate::vk::device::context::Context;
use crate::vk::device::submit::MAX_TIMESTAMPS;
use crate::vk::pipeline::bind::COUNTS;
use crate::vk::pipeline::raw_pipeline::RawPipeline;
use crate::vk::resource::buffer::{Buffer, BufferKind};
use std::sync::Arc;

/// The maximum number of kinds of counts.
const KINDS: usize = 18;
/// A low and a high word per kind.
const BYTES: u64 = KINDS as u64 * 8;

/// The buffer that shaders add to, and its content at the end of each zone.
pub(in crate::vk) struct Counting {
    counts: Arc<Buffer>,
    results: Arc<Buffer>,
    pub(in crate::vk) zones: u64,
}

impl Counting {
    pub(in crate::vk) fn new(context: &Arc<Context>) -> Result<Self> {
        let buffer = |label: &str, zones: u64, kind| {
            Ok::<_, crate::Error>(Arc::new(Buffer::new(context, label, BYTES * zones, kind)?))
        };
        let zones = u64::from(MAX_TIMESTAMPS / 2);
        Ok(Self {
            counts: buffer("counts", 1, BufferKind::Device)?,
            results: buffer("counts of all zones", zones, BufferKind::Readback)?,
            zones: 0,
        })
    }

    /// The counts of zone `zone`, after the work has finished.
    pub(in crate::vk) fn read(&self, zone: usize) -> Vec<u64> {
        self.results.read_some(zone as u64 * BYTES, KINDS)
    }
}

impl Recorder {
    /// The buffer to bind as [`COUNTS`], if the pipeline counts.
    pub(in crate::vk) fn counts_of(&self, pipeline: &RawPipeline) -> Option<Arc<Buffer>> {
        let counting = self.recorded.counting.as_ref()?;
        pipeline.bindings.iter().any(|binding| binding.name == COUNTS).then(|| counting.counts.clone())
    }

    /// Sets the counts to 0 for the next zone.
    pub(in crate::vk) fn start_counts(&mut self) {
        let Some(counting) = &self.recorded.counting else { return };
        let counts = counting.counts.clone();
        self.full_barrier();
        self.fill(&counts, 0, BYTES, 0);
        self.full_barrier();
    }

    /// Stores the counts of the zone that just ended.
    pub(in crate::vk) fn keep_counts(&mut self) {
        let Some(counting) = &mut self.recorded.counting else { return };
        let (counts, results, at) = (counting.counts.clone(), counting.results.clone(), counting.zones * BYTES);
        counting.zones += 1;
        self.full_barrier();
        self.copy_range(counts.at(0), results.at(at), BYTES);
    }
}
