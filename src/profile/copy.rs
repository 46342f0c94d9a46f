//! The device's copy rate, to which rates of passes are compared.

use std::sync::Arc;

use serde::Serialize;

use super::counts::Counts;
use crate::Result;
use crate::measure::timing::Spread;
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Context, Recorder, RecorderOptions, ZoneKind};

/// Copied bytes, which exceed the caches of most devices.
pub const BYTES: u64 = 64 << 20;
const REPEATS: usize = 7;
/// Bytes that a workgroup copies.
const GROUP_BYTES: u64 = 128 * 16;

/// Rates in gigabytes (10⁹) per second, for read and written bytes together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CopyRates {
    /// The rate of a buffer copy.
    pub buffer_gb_per_s: f64,
    /// The rate of a compute shader with 16 bytes per invocation.
    pub shader_gb_per_s: f64,
}

impl CopyRates {
    /// The better of the two.
    pub fn best(&self) -> f64 {
        self.buffer_gb_per_s.max(self.shader_gb_per_s)
    }
}

/// Two buffers, and a pass that copies one to the other.
pub struct Copy {
    context: Arc<Context>,
    pipeline: Compute,
    from: Buffer,
    to: Buffer,
    bytes: u64,
}

impl Copy {
    /// `bytes` is a multiple of 16.
    pub fn new(context: &Arc<Context>, bytes: u64) -> Result<Self> {
        let buffer = |label| Buffer::new(context, label, bytes, BufferKind::Device);
        let desc = ComputeDesc { label: "copy", shader: "profile/copy.comp", ..Default::default() };
        let pipeline = Compute::new(context, &desc)?;
        Ok(Self { context: context.clone(), pipeline, from: buffer("copied from")?, to: buffer("copied to")?, bytes })
    }

    /// Milliseconds of a buffer copy and of the pass, and the counts of the pass on a context that counts.
    pub fn run(&self) -> Result<([f64; 2], Counts)> {
        let mut recorder = Recorder::new(&self.context, RecorderOptions::default())?;
        recorder.zone("fill", ZoneKind::Transfer, self.bytes, |r| r.fill(&self.from, 0, self.bytes, 0x3f80_0000));
        recorder.zone("buffer copy", ZoneKind::Transfer, self.bytes, |r| {
            r.full_barrier(); // fill wrote the buffers
            r.copy(&self.from, &self.to);
        });
        recorder.zone("copy", ZoneKind::Compute, self.bytes, |r| {
            r.full_barrier(); // the copy wrote the same buffer
            let binds = [Bind::buffer("from", &self.from), Bind::buffer("to", &self.to)];
            r.dispatch(&self.pipeline, &binds, &(), [self.bytes.div_ceil(GROUP_BYTES) as u32, 1, 1]);
        });
        let zones = recorder.finish()?.zones;
        Ok(([zones[1].gpu_ms, zones[2].gpu_ms], Counts::of_counters(&zones[2].counts)))
    }
}

/// Medians over several copies after one warm-up.
pub fn measure(context: &Arc<Context>) -> Result<CopyRates> {
    let copy = Copy::new(context, BYTES)?;
    copy.run()?;
    let times: Vec<[f64; 2]> = (0..REPEATS).map(|_| Ok(copy.run()?.0)).collect::<Result<_>>()?;
    let rate = |which: usize| gb_per_s(2 * BYTES, Spread::of_values(times.iter().map(|t| t[which])).median);
    Ok(CopyRates { buffer_gb_per_s: rate(0), shader_gb_per_s: rate(1) })
}

/// Gigabytes per second; 0 for a time of 0.
pub fn gb_per_s(bytes: u64, ms: f64) -> f64 {
    if ms > 0.0 { bytes as f64 / ms * 1e-6 } else { 0.0 }
}
