//! Own command buffers, which are taken from a small pool, submitted, waited for and returned.

use super::context::Context;
use crate::{Error, Result};
use ash::vk;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

/// The timeout of one submission in seconds. A CPU device may take minutes for a large frame.
const TIMEOUT_S: u64 = 600;
/// Timestamps per recording: two per zone.
pub(in crate::vk) const MAX_TIMESTAMPS: u32 = 1024;

/// Vulkan objects of one recording, which are reused in later frames.
#[derive(Default)]
pub(in crate::vk) struct CommandSet {
    pool: vk::CommandPool,
    pub(in crate::vk) commands: vk::CommandBuffer,
    fence: vk::Fence,
    pub(in crate::vk) timestamps: vk::QueryPool,
}

impl CommandSet {
    fn new(context: &Context) -> std::result::Result<Self, vk::Result> {
        let mut set = Self::default();
        let filled = set.fill(context);
        if filled.is_err() {
            // SAFETY: not in use; null handles are allowed.
            unsafe { set.destroy(context.device()) };
        }
        filled.map(|()| set)
    }

    fn fill(&mut self, context: &Context) -> std::result::Result<(), vk::Result> {
        let device = context.device();
        let pool = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(context.queue_family);
        // SAFETY: the infos are complete.
        unsafe {
            self.pool = device.create_command_pool(&pool, None)?;
            self.fence = device.create_fence(&vk::FenceCreateInfo::default(), None)?;
            self.timestamps = timestamps(context)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
            self.commands = device.allocate_command_buffers(&info)?[0];
        }
        Ok(())
    }

    pub(in crate::vk) unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller's: the set is not in flight.
        unsafe {
            device.destroy_query_pool(self.timestamps, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }

    fn begin(&self, device: &ash::Device) -> std::result::Result<(), vk::Result> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the set is not in flight: it is new or was waited for.
        unsafe {
            device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())?;
            device.begin_command_buffer(self.commands, &info)
        }
    }
}

/// A query pool for one recording.
pub(in crate::vk) fn timestamps(context: &Context) -> std::result::Result<vk::QueryPool, vk::Result> {
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(MAX_TIMESTAMPS);
    // SAFETY: the info is complete.
    unsafe { context.device().create_query_pool(&info, None) }
}

/// A command buffer that is being recorded or is in flight. When it is dropped, it returns to the pool after a wait.
pub(in crate::vk) struct Commands {
    context: Arc<Context>,
    set: Option<CommandSet>,
    in_flight: bool,
}

impl Commands {
    pub(in crate::vk) fn begin(context: &Arc<Context>) -> Result<Self> {
        context.queue()?;
        let reused = context.commands.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let failed = |result| context.error("starting to record", result);
        let set = match reused {
            Some(set) => set,
            None => CommandSet::new(context).map_err(failed)?,
        };
        let this = Self { context: context.clone(), set: Some(set), in_flight: false };
        this.set().begin(context.device()).map_err(failed)?;
        record_entry_barrier(context, this.set().commands);
        Ok(this)
    }

    pub(in crate::vk) fn set(&self) -> &CommandSet {
        self.set.as_ref().expect("taken only by drop")
    }

    /// Submits the recording; `doing` is for the error.
    pub(in crate::vk) fn submit(&mut self, doing: &str) -> Result<()> {
        let set = self.set.as_ref().expect("taken only by drop");
        let failed = |result| self.context.error(doing, result);
        let commands = [set.commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        record_exit_barrier(&self.context, set.commands);
        // SAFETY: the buffer is recording, outside a rendering scope; the queue is locked.
        unsafe {
            let device = self.context.device();
            device.end_command_buffer(set.commands).map_err(failed)?;
            let queue = self.context.queue()?.lock().unwrap_or_else(PoisonError::into_inner);
            if self.context.loses() {
                return Err(failed(vk::Result::ERROR_DEVICE_LOST));
            }
            device.queue_submit(*queue, &submit, set.fence).map_err(failed)?;
        }
        self.in_flight = true;
        Ok(())
    }

    /// Whether the device has finished the submission.
    pub(in crate::vk) fn poll(&self, doing: &str) -> Result<bool> {
        // SAFETY: the fence is alive.
        let status = unsafe { self.context.device().get_fence_status(self.set().fence) };
        status.map_err(|result| self.context.error(doing, result))
    }

    /// Waits for the submission.
    pub(in crate::vk) fn wait(&mut self, doing: &str) -> Result<()> {
        let (device, fence) = (self.context.device(), self.set().fence);
        let failed = |result| self.context.error(doing, result);
        // SAFETY: the fence was submitted.
        match unsafe { device.wait_for_fences(&[fence], true, TIMEOUT_S * 1_000_000_000) } {
            Ok(()) => {}
            Err(vk::Result::TIMEOUT) => {
                self.context.stuck.store(true, Ordering::Relaxed);
                return Err(Error::Device(format!(
                    "{} did not finish {doing} within {TIMEOUT_S} s: ask for less at once, such as a smaller image",
                    self.context.name
                )));
            }
            Err(result) => return Err(failed(result)),
        }
        // SAFETY: the fence is signalled, so not in use.
        unsafe { device.reset_fences(&[fence]) }.map_err(failed)?;
        self.in_flight = false;
        Ok(())
    }

    pub(in crate::vk) fn submit_and_wait(&mut self, doing: &str) -> Result<()> {
        self.submit(doing)?;
        self.wait(doing)
    }

    /// Starts a new recording after [`Self::submit_and_wait`].
    pub(in crate::vk) fn begin_again(&mut self) -> Result<()> {
        let begun = self.set().begin(self.context.device());
        begun.map_err(|result| self.context.error("starting to record", result))?;
        record_entry_barrier(&self.context, self.set().commands);
        Ok(())
    }
}

/// Makes the writes of all earlier commands visible to later ones.
pub(in crate::vk) fn record_entry_barrier(context: &Context, commands: vk::CommandBuffer) {
    use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
    record_barrier(context, commands, WRITTEN, (S::ALL_COMMANDS, A::MEMORY_READ | A::MEMORY_WRITE));
}

/// Makes all writes visible to later commands and to the CPU.
pub(in crate::vk) fn record_exit_barrier(context: &Context, commands: vk::CommandBuffer) {
    use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
    let read = A::MEMORY_READ | A::MEMORY_WRITE | A::HOST_READ;
    record_barrier(context, commands, WRITTEN, (S::ALL_COMMANDS | S::HOST, read));
}

/// Stages and their accesses.
type Scope = (vk::PipelineStageFlags2, vk::AccessFlags2);

const WRITTEN: Scope = (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE);

/// Records a barrier from all earlier work in `from` to all later work in `to`, outside a rendering scope.
pub(in crate::vk) fn record_barrier(context: &Context, commands: vk::CommandBuffer, from: Scope, to: Scope) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)];
    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: the buffer is recording, outside a rendering scope.
    unsafe { context.device().cmd_pipeline_barrier2(commands, &info) };
}

/// Records a barrier for one image, which may change its layout, outside a rendering scope.
pub(in crate::vk) fn record_image_barrier(
    context: &Context,
    commands: vk::CommandBuffer,
    barrier: vk::ImageMemoryBarrier2<'_>,
) {
    let barriers = [barrier];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: the buffer is recording, outside a rendering scope.
    unsafe { context.device().cmd_pipeline_barrier2(commands, &info) };
}

impl Drop for Commands {
    fn drop(&mut self) {
        if self.in_flight
            && !self.context.stuck.load(Ordering::Relaxed)
            && let Err(error) = self.wait("rendering")
        {
            tracing::warn!("{error}");
        }
        // After a timeout the set may still be in flight, so it is not touched.
        let Some(device) = self.context.device_to_destroy_with() else { return };
        let Some(set) = self.set.take() else { return };
        if self.in_flight {
            // SAFETY: the device is lost, so nothing runs any more. The fence cannot be reused.
            unsafe { set.destroy(device) };
        } else {
            self.context.commands.lock().unwrap_or_else(PoisonError::into_inner).push(set);
        }
    }
}

/// Records with `record`, submits and waits, for setup outside of frames.
#[cfg_attr(not(internals), doc(hidden))]
pub fn immediate(context: &Arc<Context>, record: impl FnOnce(vk::CommandBuffer)) -> Result<()> {
    let mut commands = Commands::begin(context)?;
    record(commands.set().commands);
    commands.submit_and_wait("setting up")
}
