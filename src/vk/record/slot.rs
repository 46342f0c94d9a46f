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

/// Options of a [`Slot`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlotOptions {
    /// Whether to create a query pool, and to write timestamps at both ends of each zone.
    pub timestamps: bool,
    /// Whether a log is kept: see [`RecorderOptions::log`](crate::vk::RecorderOptions::log).
    pub log: bool,
}

/// One of a host's frames in flight. It keeps the resources of the frame's commands alive and reads its times. All of
/// its Vulkan objects are created with it, and its lists keep their capacity.
pub struct Slot {
    context: Arc<Context>,
    options: SlotOptions,
    /// The query pool; null without timestamps.
    timestamps: vk::QueryPool,
    recorded: Recorded,
    /// Milliseconds of CPU time of the last recording.
    recording_ms: f64,
}

impl Slot {
    /// An empty slot.
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

    /// The times of the last recording, after the host has waited for it. `None` without timestamps, without a
    /// recording, or before the device has finished. `wall_ms` is the CPU time of recording.
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

    /// Drops the resources of the last recording, and its times.
    ///
    /// # Safety
    /// The device has finished the recording of this slot, which is not submitted again.
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
    /// Records the commands of `record` into `command_buffer`, which a host begins, ends and submits itself. Nothing is
    /// allocated from Vulkan, submitted or waited for. `slot` keeps the resources alive until it is used again.
    ///
    /// The first command is a barrier that makes the writes of the host's earlier commands visible to all later ones.
    /// The last one makes all writes visible to the host's later commands and to the CPU. Both are memory barriers over
    /// all commands. Images of the host are not touched, and those created here are in `GENERAL` layout before and
    /// after.
    ///
    /// The recording overwrites the compute and the graphics pipelines, the descriptor sets of both bind points (set 0
    /// is pushed), push constants, viewport and scissor 0, all other dynamic state (the graphics pipelines fix it), the
    /// index buffer and vertex buffer 0. A host sets its own state again afterwards. Other vertex buffers and the state
    /// for ray tracing are not changed.
    ///
    /// # Safety
    /// - `command_buffer` belongs to the context's device and queue family. It is recording, outside of a render pass
    ///   or rendering scope, and without an active query or conditional rendering.
    /// - The device has finished the earlier recording of `slot`, which is not submitted again.
    /// - `slot` is reused, cleared or dropped only after the device has finished this recording.
    /// - Recordings of one context that share resources are submitted in the order of recording to one queue, or the
    ///   host orders them by semaphores.
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
        // After a panic a rendering scope may be open, in which neither command is allowed; resources are kept alive
        // anyway.
        if outcome.is_ok() {
            recorder.timestamp();
            record_exit_barrier(context, command_buffer);
        }
        (slot.recorded, slot.recording_ms) = recorder.into_recorded();
        outcome.unwrap_or_else(|panic| resume_unwind(panic));
    }
}
