//! What was submitted and is not waited for yet.

use super::recorded::Recorded;
use super::zone::ZoneTimings;
use crate::Result;
use crate::vk::device::context::Context;
use crate::vk::device::submit::Commands;
use ash::vk::QueryResultFlags;
use std::sync::Arc;
use std::time::Instant;

/// Commands that the device may still be at work on, with everything that they use. Several may be in flight at once:
/// each starts after those submitted before it. Dropping one waits for it.
pub struct Pending {
    context: Arc<Context>,
    // Declared before what its commands use: dropping the commands waits for them.
    commands: Commands,
    recorded: Recorded,
    started: Instant,
}

impl Pending {
    pub(in crate::vk) fn new(context: Arc<Context>, commands: Commands, recorded: Recorded, started: Instant) -> Self {
        Self { context, commands, recorded, started }
    }

    /// Whether the device is done; does not wait.
    ///
    /// # Errors
    /// The device is lost.
    pub fn poll(&self) -> Result<bool> {
        self.commands.poll("rendering")
    }

    /// Waits until the device is done, and reads the times.
    ///
    /// # Errors
    /// The device is lost, or it took longer than ten minutes.
    pub fn wait(mut self) -> Result<ZoneTimings> {
        self.commands.wait("rendering")?;
        let wall_ms = self.started.elapsed().as_secs_f64() * 1e3;
        let pool = self.commands.set().timestamps;
        let timings = self.recorded.timings(&self.context, pool, QueryResultFlags::WAIT, wall_ms)?;
        Ok(timings.expect("the query waits"))
    }
}
