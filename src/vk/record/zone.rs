//! Times of zones, and of the frames that contain them.

use serde::Serialize;

/// The main kind of work of a zone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ZoneKind {
    #[default]
    Raster,
    Compute,
    Transfer,
}

/// The times of one zone of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZoneTiming {
    pub name: &'static str,
    pub kind: ZoneKind,
    /// From the frame's first timestamp to this zone's, in milliseconds of device time.
    pub start_ms: f64,
    /// Between the timestamps at its ends, in milliseconds of device time.
    pub gpu_ms: f64,
    /// Processor time of the whole process, in milliseconds over all threads; only with one submission per pass.
    pub cpu_ms: Option<f64>,
    /// From before its submission to after the wait, in milliseconds; only with one submission per pass.
    pub wall_ms: Option<f64>,
    /// Estimated bytes that it writes, as stated by the pass.
    pub bytes: u64,
    /// Counts of reads and steps of its shaders by kind; empty unless the context counts.
    pub counts: Vec<u64>,
    /// Device time of each level of mips, or step of propagation, in milliseconds; empty unless steps are timed
    /// ([`RenderOptions::steps`](crate::renderer::RenderOptions::steps)).
    pub steps_ms: Vec<f64>,
}

/// The times of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZoneTimings {
    pub zones: Vec<ZoneTiming>,
    /// From the first timestamp to the last, in milliseconds of device time.
    pub gpu_ms: f64,
    /// From the making of the recorder to the end of the wait, in milliseconds.
    pub wall_ms: f64,
}

impl ZoneTimings {
    /// The times of a frame that continues in a second submission.
    #[must_use]
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn then(mut self, later: Self) -> Self {
        self.zones
            .extend(later.zones.into_iter().map(|zone| ZoneTiming { start_ms: self.gpu_ms + zone.start_ms, ..zone }));
        Self { gpu_ms: self.gpu_ms + later.gpu_ms, wall_ms: self.wall_ms + later.wall_ms, ..self }
    }
}

/// Processor time that this process has used over all threads, in milliseconds.
#[cfg(unix)]
pub fn process_cpu_ms() -> Option<f64> {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid for the call.
    let result = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    (result == 0).then_some(time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6)
}

#[cfg(not(unix))]
pub fn process_cpu_ms() -> Option<f64> {
    None
}
