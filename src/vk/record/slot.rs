//! Recording into a host's command buffer.

use super::counting::Counting;
use super::frame_log::FrameLog;
use super::recorded::Recorded;
use super::recorder::Recorder;
use super::zone::ZoneTimings;
use crate::Result;
use crate::vk::device::context::Context;
use crate::vk::device::submit::{self, record_entry_barrier, record_exit_barrier};
use ash::vk;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;

/// Measurements that a [`Slot`] makes, and whether it keeps a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlotOptions {
    /// Make a query pool, and write a timestamp at both ends of each zone.
    pub timestamps: bool,
    /// As [`RecorderOptions::log`](crate::vk::RecorderOptions::log).
    pub log: bool,
}

/// One of a host's frames in flight: it keeps alive what the frame's commands use, and reads its times. All its Vulkan
/// objects are made with it. Its lists keep their capacity from frame to frame.
pub struct Slot {
    context: Arc<Context>,
    options: SlotOptions,
    /// Null without timestamps.
    timestamps: vk::QueryPool,
    recorded: Recorded,
    /// Milliseconds that the last recording took on the CPU.
    recording_ms: f64,
}

impl Slot {
    /// A slot that holds nothing yet.
    ///
    /// # Errors
    /// The device has no memory left.
    pub fn new(context: &Arc<Context>, options: SlotOptions) -> Result<Self> {
        let timestamps = if options.timestamps {
            submit::timestamps(context).map_err(|result| context.error("making a query pool", result))?
        } else {
            vk::QueryPool::null()
        };
        let mut slot =
            Self { context: context.clone(), options, timestamps, recorded: Recorded::default(), recording_ms: 0.0 };
        slot.recorded.counting = context.counting.then(|| Counting::new(context)).transpose()?;
        Ok(slot)
    }

    /// The times of the last recording, to be read once the host has waited for it. `None` where there are no
    /// timestamps, nothing was recorded, or the device is not done. `wall_ms` is what recording took on the CPU.
    ///
    /// # Errors
    /// The device is lost.
    pub fn timings(&self, context: &Arc<Context>) -> Result<Option<ZoneTimings>> {
        self.check(context);
        if self.timestamps == vk::QueryPool::null() || self.recorded.timestamps == 0 {
            return Ok(None);
        }
        self.recorded.timings(context, self.timestamps, vk::QueryResultFlags::empty(), self.recording_ms)
    }

    /// Commands recorded last; empty without [`SlotOptions::log`].
    pub fn frame_log(&self) -> &FrameLog {
        &self.recorded.log
    }

    /// Lets go of what the last recording used, and of its times.
    ///
    /// # Safety
    /// The device is done with what was recorded over this slot, and it is not submitted again.
    pub unsafe fn clear(&mut self) {
        self.recorded.clear();
    }

    fn check(&self, context: &Arc<Context>) {
        assert!(Arc::ptr_eq(context, &self.context), "the slot belongs to another context");
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        if let Some(device) = self.context.device_to_destroy_with() {
            // SAFETY: the caller of `Recorder::on` waits before the slot is dropped. Null is allowed.
            unsafe { device.destroy_query_pool(self.timestamps, None) };
        }
    }
}

impl Recorder {
    /// Records what `record` does into `command_buffer`, which a host has begun and ends and submits itself. Nothing is
    /// allocated from Vulkan, submitted or waited for. `slot` keeps alive what the commands use until it is recorded
    /// over again.
    ///
    /// The first command is a barrier: everything that the host's earlier commands wrote is visible to all that
    /// follows. The last makes everything written here visible to the host's later commands and to the CPU. Both are
    /// memory barriers over all commands. Images of the host are not touched, and those made here are in `GENERAL`
    /// layout before and after.
    ///
    /// Clobbered are: the compute and the graphics pipeline, the descriptor sets of both bind points (set 0 is pushed),
    /// push constants, viewport and scissor 0, all other dynamic state (the graphics pipelines fix it), the index
    /// buffer and vertex buffer 0. A host sets its own again afterwards. Other vertex buffers, and what is bound for
    /// ray tracing, stay.
    ///
    /// # Safety
    /// - `command_buffer` belongs to the context's device and queue family, it is recording, it is outside of a
    ///   render pass or rendering scope, and no query and no conditional rendering is active in it.
    /// - What was recorded over `slot` before is done, and is not submitted again.
    /// - `slot` is recorded over again, cleared or dropped only when the device is done with this recording.
    /// - Recordings of one context that share resources are submitted in the order in which they were recorded, to one
    ///   queue, or the host orders them by semaphores.
    pub unsafe fn on(
        context: &Arc<Context>,
        command_buffer: vk::CommandBuffer,
        slot: &mut Slot,
        record: impl FnOnce(&mut Self),
    ) {
        slot.check(context);
        slot.recorded.clear();
        record_entry_barrier(context, command_buffer);
        let recorded = std::mem::take(&mut slot.recorded);
        let mut recorder = Self::start(context, command_buffer, slot.timestamps, recorded);
        recorder.options.log = slot.options.log;
        let outcome = catch_unwind(AssertUnwindSafe(|| record(&mut recorder)));
        // After a panic a rendering scope may be open, where neither may be recorded; what was used is kept all the
        // same.
        if outcome.is_ok() {
            recorder.timestamp();
            record_exit_barrier(context, command_buffer);
        }
        (slot.recorded, slot.recording_ms) = recorder.into_recorded();
        outcome.unwrap_or_else(|panic| resume_unwind(panic));
    }
}
