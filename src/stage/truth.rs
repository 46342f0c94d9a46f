//! The path-traced picture of a scene in one call.

use std::sync::atomic::AtomicBool;

use super::{Image, Options, Staged};
use crate::layers::Aov;
use crate::output::display::Display;
use crate::output::exr::Metadata;
use crate::reference::cache::Cache;
use crate::reference::film::Film;
use crate::reference::{self, Depth, Progress, Stop, VERSION};
use crate::scene::{Scene, Still};
use crate::{Error, Result, memory};

/// Options of the path tracer.
#[derive(Clone, Debug)]
pub struct PathTracing {
    /// The number of indirect bounces; by default all light.
    pub bounces: Option<u32>,
    /// Samples per pixel, at least 2; by default as many as [`PathTracing::noise`] needs.
    pub samples: Option<u32>,
    /// Samples are added until the root mean square of the pixels' relative error is at most this share.
    pub noise: f64,
    /// The seed of the random numbers.
    pub seed: u64,
    /// A cache that keeps samples between calls.
    pub cache: Option<Cache>,
}

impl Default for PathTracing {
    /// The defaults of `twobounce reference`: two bounces and 1 % of noise. Samples are not kept.
    fn default() -> Self {
        Self { bounces: Some(2), samples: None, noise: 0.01, seed: 0, cache: None }
    }
}

/// Path-traces an unbiased picture of a scene on the CPU: the reference of [`render`](fn@super::render). Only size,
/// stage, layers, transparency, tone, exposure and cancellation of `options` are used. `progress` is called with the
/// number of paths from any thread.
///
/// # Errors
/// As for [`render`](fn@super::render), but no device is needed.
pub fn path_trace(
    scene: &Scene,
    options: &Options,
    how: &PathTracing,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Image> {
    options.check()?;
    if !(how.noise > 0.0 && how.noise.is_finite())
        || how.samples.is_some_and(|samples| !(2..=1 << 24).contains(&samples))
    {
        return Err(Error::Usage(
            "a picture is traced to a noise above 0, or with 2 to 16777216 samples a pixel".into(),
        ));
    }
    options.stage.check()?;
    scene.check()?;
    check_film(options.size)?;
    let mut staged = Staged::new(scene.clone(), &options.stage, options.size)?;
    staged.scene.sky_unseen = options.transparent;
    let depth = how.bounces.map_or(Depth::Full, Depth::Bounces);
    let traced = reference::Options {
        width: options.size.0,
        height: options.size.1,
        depth,
        stop: how.samples.map_or(Stop::Noise(how.noise), Stop::Samples),
        seed: how.seed,
        occlusion: options.layers.contains(&Aov::Ao),
    };
    let (pose, view) = &staged.still;
    let still = Still::new(&staged.scene, pose, view);
    let never = AtomicBool::new(false);
    let cancel = options.cancel.as_deref().unwrap_or(&never);
    let film = how.cache.clone().unwrap_or_else(Cache::none).render(still, &traced, progress, cancel)?;
    let mut header = truth_header(&staged, depth, how.seed);
    header.extend(film.header());
    let alpha = options.transparent.then_some(Aov::Alpha);
    let layers = film.layers(&options.layers.iter().copied().chain(alpha).collect::<Vec<_>>());
    let display = match options.exposure_ev {
        Some(exposure_ev) => Display { tone: options.tone, exposure_ev },
        None => Display::automatic(options.tone, layers.beauty()),
    };
    let mut notes = staged.notes;
    let rejected = film.rejected();
    notes.extend((rejected > 0).then(|| format!("{rejected} samples were not finite and count as black")));
    Ok(Image { layers, display, notes, noise: Some(film.noise()), settings: None, header })
}

/// Metadata of a path-traced .exr.
pub fn truth_header(staged: &Staged, depth: Depth, seed: u64) -> Metadata {
    let depth = match depth {
        Depth::Full => "full".to_owned(),
        Depth::Bounces(n) => format!("direct light and {n} indirect bounces"),
    };
    staged.header([
        ("writer", format!("twobounce {} reference, tracer {VERSION}", env!("CARGO_PKG_VERSION"))),
        ("depth", depth),
        ("seed", seed.to_string()),
    ])
}

/// Refuses a film that does not fit into memory.
pub fn check_film((width, height): (u32, u32)) -> Result<()> {
    let needed = Film::bytes(width, height);
    let Some(available) = memory::available().filter(|available| needed > *available) else { return Ok(()) };
    let [needed, available] = [needed, available].map(|bytes| bytes >> 20);
    let text =
        format!("a reference of {width}x{height} needs {needed} MiB, {available} are free; choose a smaller --size");
    Err(Error::Memory(text))
}
