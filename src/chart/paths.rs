//! Rows of this program's own path tracer: the reference's image along few paths a pixel, as an offline renderer would
//! give it.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::measure::{ChartScene, Images, LONG_ENOUGH_MS, MOST_FRAMES};
use super::row::{Measured, Pictures};
use super::subject::Subject;
use crate::Result;
use crate::layers::Aov;
use crate::measure::metrics::NonFinite;
use crate::measure::timing::Spread;
use crate::reference::film::Film;
use crate::reference::{self, Control, Depth, Options, Stop};
use crate::scene::Still;
use crate::vk::process_cpu_ms;

/// Paths a pixel of a chart's rows.
pub const PATHS: &[u32] = &[1, 4, 16, 64];

/// Most paths a pixel of a row: more are a reference.
pub const MOST_PATHS: u32 = 1 << 16;

/// Another one than that of references, whose noise would else be the row's own.
pub const SEED: u64 = 1;

impl ChartScene {
    /// Path-traces the scene along so many paths a pixel and compares the image with the references; `None` once
    /// `go_on` says no, which is asked between traces. The time is the wall time of a trace on all threads, with the
    /// tree of the scene's triangles, as the time of a frame has its voxels. The median is of as many traces as take
    /// two seconds together, five at most.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] once `cancel` is set.
    pub fn measure_paths(
        &self,
        paths: u32,
        cancel: &AtomicBool,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<(Measured, Pictures, Images)>> {
        let options = Options { seed: SEED, ..self.reference_options(Depth::Full, Stop::Samples(paths)) };
        let (mut wall_ms, mut cpu_ms) = (Vec::new(), Vec::new());
        let film = loop {
            if !go_on() {
                return Ok(None);
            }
            let mut film = Film::new(options.width, options.height);
            let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel };
            let (begin, before) = (Instant::now(), process_cpu_ms());
            reference::render(Still::new(&self.scene, &self.pose, &self.view), &options, &mut film, control)?;
            wall_ms.push(begin.elapsed().as_secs_f64() * 1e3);
            cpu_ms.push(process_cpu_ms().zip(before).map(|(after, before)| after - before));
            if wall_ms.len() >= MOST_FRAMES || wall_ms.iter().sum::<f64>() >= LONG_ENOUGH_MS {
                break film;
            }
        };
        let images = Images { whole: film.layers(&[Aov::Direct]), equal: None };
        let ([full, same], pictures) = self.judge(&Subject::Paths(paths), &images)?;
        let cpu_ms: Option<Vec<f64>> = cpu_ms.into_iter().collect();
        let measured = Measured {
            frames: wall_ms.len(),
            frame_gpu_ms: None,
            frame_cpu_ms: cpu_ms.map(Spread::of),
            frame_wall_ms: Some(Spread::of(wall_ms)),
            passes: Vec::new(),
            memory_bytes: None,
            nonfinite: NonFinite::of(images.whole.beauty()).count(),
            equal_terms: Vec::new(),
            full,
            same,
        };
        Ok(Some((measured, pictures, images)))
    }
}
