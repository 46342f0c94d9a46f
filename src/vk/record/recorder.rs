//! Recording of a frame: zones with timestamps and labels. `commands.rs` has its commands.

use super::counting::Counting;
use super::frame_log::{CommandLog, FrameLog};
use super::pace::Pacing;
use super::recorded::{Recorded, Zone};
use super::zone::{ZoneKind, ZoneTiming, ZoneTimings, process_cpu_ms};
use crate::vk::device::context::Context;
use crate::vk::device::submit::{CommandSet, Commands, MAX_TIMESTAMPS, record_barrier, record_image_barrier};
use crate::{Error, Result};
use ash::vk;
use std::any::Any;
use std::sync::{Arc, PoisonError};
use std::time::Instant;

/// Options for the submission of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecorderOptions {
    /// Whether each zone is submitted separately and waited for, which also measures its CPU and wall times.
    pub per_pass: bool,
    /// Whether steps of zones are timed ([`Recorder::end_step`]).
    pub steps: bool,
    /// Whether a [`FrameLog`] of every command is kept for tests, which takes time and memory.
    pub log: bool,
}

/// Records commands into its own command buffer and submits it, or into a host's ([`Recorder::on`]). Recording itself
/// cannot fail: [`Recorder::submit`], [`Recorder::finish`] and the wait return errors.
pub struct Recorder {
    context: Arc<Context>,
    /// The own command buffer; `None` for a host's. It is declared before the resources of its commands, because
    /// dropping it waits for them.
    own: Option<Commands>,
    pub(in crate::vk) handle: vk::CommandBuffer,
    /// The query pool; null without timestamps.
    pool: vk::QueryPool,
    pub(in crate::vk) options: RecorderOptions,
    /// The current zone.
    pub(in crate::vk) zone: Option<(&'static str, ZoneKind)>,
    /// The timestamps at the ends of the current zone's steps.
    steps: Vec<u32>,
    pub(in crate::vk) recorded: Recorded,
    pub(in crate::vk) pacing: Option<Pacing>,
    error: Option<Error>,
    started: Instant,
}

impl Recorder {
    /// Starts a recording. Writes of earlier submissions are visible to it.
    pub fn new(context: &Arc<Context>, options: RecorderOptions) -> Result<Self> {
        let commands = Commands::begin(context)?;
        let counting = context.counting.then(|| Counting::new(context)).transpose()?;
        let CommandSet { commands: handle, timestamps: pool, .. } = *commands.set();
        let recorded = Recorded { counting, ..Recorded::default() };
        Ok(Self { own: Some(commands), options, ..Self::start(context, handle, pool, recorded) })
    }

    /// Starts a recording into a command buffer, with timestamps unless the query pool is null.
    pub(in crate::vk) fn start(
        context: &Arc<Context>,
        handle: vk::CommandBuffer,
        pool: vk::QueryPool,
        recorded: Recorded,
    ) -> Self {
        let mut this = Self {
            context: context.clone(),
            own: None,
            handle,
            pool,
            options: RecorderOptions::default(),
            zone: None,
            steps: Vec::new(),
            recorded,
            pacing: None,
            error: None,
            started: Instant::now(),
        };
        this.reset_timestamps();
        for (image, transition) in this.context.take_untransitioned() {
            if let Some(image) = image.upgrade() {
                record_image_barrier(&this.context, this.handle, transition);
                this.keep(image);
            }
        }
        this.timestamp();
        this
    }

    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }

    /// Commands recorded so far; empty without [`RecorderOptions::log`].
    pub fn frame_log(&self) -> &FrameLog {
        &self.recorded.log
    }

    pub(in crate::vk) fn keep(&mut self, used: Arc<dyn Any + Send + Sync>) {
        self.recorded.keep.push(used);
    }

    /// Logs the result of `command` if a log is kept; otherwise `command` is not called.
    pub(in crate::vk) fn log(&mut self, command: impl FnOnce() -> CommandLog) {
        if self.options.log {
            self.recorded.log.push(self.zone, command());
        }
    }

    /// Records `record` as one pass called `name`, timed and labelled. `bytes_written` is the pass's own estimate.
    /// Zones do not nest.
    pub fn zone(&mut self, name: &'static str, kind: ZoneKind, bytes_written: u64, record: impl FnOnce(&mut Self)) {
        assert!(self.zone.is_none(), "zone {name} inside of zone {:?}", self.zone);
        if !self.goes_on() {
            return;
        }
        if self.options.per_pass {
            self.flush();
        }
        self.pace_pass(name);
        self.recorded.log.close();
        self.start_counts();
        let (cpu, wall) = if self.options.per_pass { (process_cpu_ms(), Some(Instant::now())) } else { (None, None) };
        self.zone = Some((name, kind));
        let first_timestamp = self.timestamp();
        self.context.begin_label(self.handle, name);
        record(self);
        self.context.end_label(self.handle);
        let last_timestamp = self.timestamp();
        self.zone = None;
        self.recorded.log.close();
        self.keep_counts();
        if self.options.per_pass {
            self.flush();
        }
        let timing = ZoneTiming {
            name,
            kind,
            start_ms: 0.0,
            gpu_ms: 0.0,
            cpu_ms: cpu.and_then(|before| Some(process_cpu_ms()? - before)),
            wall_ms: wall.map(|before| before.elapsed().as_secs_f64() * 1e3),
            bytes: bytes_written,
            counts: Vec::new(),
            steps_ms: Vec::new(),
        };
        let steps = std::mem::take(&mut self.steps);
        self.recorded.zones.push(Zone { timing, timestamps: first_timestamp..=last_timestamp, steps });
        self.pace_pass_end(name);
    }

    /// Ends a step of the current zone: a level of mips, or a step of propagation. It is timed with
    /// [`RecorderOptions::steps`].
    pub fn end_step(&mut self) {
        if self.options.steps {
            let timestamp = self.timestamp();
            self.steps.push(timestamp);
        }
    }

    /// Whether no error has occurred so far. Later recordings are not submitted after one.
    pub(crate) fn goes_on(&self) -> bool {
        self.error.is_none()
    }

    /// Keeps the first error for [`Self::submit`].
    pub(in crate::vk) fn fail(&mut self, error: Error) {
        self.error.get_or_insert(error);
    }

    /// Submits without waiting. Earlier submissions finish before this one starts.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn submit(mut self) -> Result<Pending> {
        self.timestamp();
        match self.error.take() {
            Some(error) => return Err(error),
            None => self.commands().submit("rendering")?,
        }
        Ok(Pending(self))
    }

    fn commands(&mut self) -> &mut Commands {
        self.own.as_mut().expect("a host submits its own command buffer")
    }

    /// Submits, waits and reads the times.
    ///
    /// # Errors
    /// As [`Self::submit`], or the device took longer than ten minutes.
    pub fn finish(self) -> Result<ZoneTimings> {
        let (pace, submitted) = (self.pacing.as_ref().map(|pacing| pacing.pace.clone()), Instant::now());
        let timings = self.submit()?.wait()?;
        if let Some(pace) = pace {
            let ms = submitted.elapsed().as_secs_f64() * 1e3;
            pace.lock().unwrap_or_else(PoisonError::into_inner).measured(ms);
        }
        Ok(timings)
    }

    /// The results of the recording, and the milliseconds that it took.
    pub(in crate::vk) fn into_recorded(self) -> (Recorded, f64) {
        (self.recorded, self.started.elapsed().as_secs_f64() * 1e3)
    }

    /// Writes the next timestamp after all earlier commands. Returns its index.
    pub(in crate::vk) fn timestamp(&mut self) -> u32 {
        let (index, pool) = (self.recorded.timestamps, self.pool);
        self.recorded.timestamps += 1;
        if pool != vk::QueryPool::null() {
            assert!(index < MAX_TIMESTAMPS, "more than {} zones in one submission", MAX_TIMESTAMPS / 2 - 1);
            let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
            // SAFETY: the query was reset and not written since.
            unsafe { self.context.device().cmd_write_timestamp(self.handle, stage, pool, index) };
            if self.context.is_cpu {
                // After a draw, Mesa's lavapipe writes a timestamp with the next flush, and dispatches do not flush.
                // Every barrier does; this one orders nothing.
                let none = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE);
                record_barrier(&self.context, self.handle, none, none);
            }
        }
        self.recorded.first_timestamp() + index
    }

    fn reset_timestamps(&self) {
        if self.pool != vk::QueryPool::null() {
            let device = self.context.device();
            // SAFETY: the buffer is recording; the pool is not in use.
            unsafe { device.cmd_reset_query_pool(self.handle, self.pool, 0, MAX_TIMESTAMPS) };
        }
    }

    /// Submits the recording, waits, and continues with a new one. Returns the milliseconds that this took; `None` if
    /// there is nothing to submit or after an error, the first of which is kept for `submit`.
    pub(in crate::vk) fn flush(&mut self) -> Option<f64> {
        if self.own.is_none() || self.error.is_some() {
            return None;
        }
        if self.zone.is_some() {
            self.context.end_label(self.handle);
        }
        self.timestamp();
        let submitted = Instant::now();
        let flushed = self.submit_and_begin_again();
        let ms = submitted.elapsed().as_secs_f64() * 1e3;
        if let Err(error) = flushed {
            self.error = Some(error);
            return None;
        }
        self.reset_timestamps();
        self.timestamp();
        if let Some((name, _)) = self.zone {
            self.context.begin_label(self.handle, name);
        }
        Some(ms)
    }

    fn submit_and_begin_again(&mut self) -> Result<()> {
        self.commands().submit_and_wait("rendering")?;
        self.recorded.take_ticks(&self.context, self.pool)?;
        self.commands().begin_again()
    }
}

/// Submitted commands with all of their resources. Several may be in flight: each starts after the earlier ones.
/// Dropping one waits for it.
pub struct Pending(Recorder);

impl Pending {
    /// Whether the device has finished; does not wait.
    ///
    /// # Errors
    /// The device is lost.
    pub fn poll(&self) -> Result<bool> {
        self.0.own.as_ref().expect("it was submitted here").poll("rendering")
    }

    /// Waits until the device has finished, and reads the times.
    ///
    /// # Errors
    /// The device is lost, or took longer than ten minutes.
    pub fn wait(mut self) -> Result<ZoneTimings> {
        self.0.commands().wait("rendering")?;
        let Recorder { context, recorded, pool, started, .. } = &self.0;
        let wall_ms = started.elapsed().as_secs_f64() * 1e3;
        let timings = recorded.timings(context, *pool, vk::QueryResultFlags::WAIT, wall_ms)?;
        Ok(timings.expect("the query waits"))
    }
}
