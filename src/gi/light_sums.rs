//! Sums of a method's light over blocks of its grid: feedback has settled once they no longer change.

use super::CoarseLight;
use crate::Result;
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Context, Recorder, ZoneKind};

/// Bytes of the sums: one of 64 bits for each of 4³ blocks (`glsl/ground/light_sums.glsl`).
const BYTES: u64 = 4 * 4 * 4 * 8;

/// The memory of [`LightSums`].
pub const ROW: MemoryRow = ("light sums", BYTES);

/// The sums, and the pass that computes them.
pub struct LightSums {
    pass: Compute,
    sums: Buffer,
}

impl LightSums {
    /// `shader` adds to the buffer `light_sums`.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &std::sync::Arc<Context>, shader: &str, constants: &[Constant]) -> Result<Self> {
        Ok(Self {
            pass: Compute::new(context, &ComputeDesc { label: "sums", shader, constants })?,
            sums: Buffer::new(context, ROW.0, BYTES, BufferKind::Device)?,
        })
    }

    /// Clears the sums, and records the pass by `dispatch`, which is given the pass and the binding of the sums.
    pub fn record<'a>(&'a self, r: &mut Recorder, dispatch: impl FnOnce(&mut Recorder, &Compute, Bind<'a>)) {
        r.zone("sums", ZoneKind::Compute, BYTES, |r| {
            r.full_barrier(); // the light was written, the sums before may have been read
            r.fill(&self.sums, 0, BYTES, 0);
            r.full_barrier(); // the sums are cleared
            dispatch(r, &self.pass, Bind::buffer("light_sums", &self.sums));
        });
    }

    /// The sums as the measure of settling.
    pub fn coarse(&self) -> CoarseLight<'_> {
        CoarseLight::Sums(&self.sums)
    }
}
