//! The reference: an unbiased path tracer on the CPU. It shares the scene and its materials with the renderer, nothing else.
//!
//! [`render`] brings a [`Film`] to where [`Options`] want it; [`cache::Cache`] keeps films between runs. Known to be missing,
//! because no path of this kind finds it: light of lamps without extent that refraction or mirrors focus (caustics).

mod bsdf;
mod bvh;
pub mod cache;
mod camera;
pub mod film;
mod geometry;
mod integrator;
mod lanes;
mod large;
mod lights;
mod material;
mod microfacet;
mod points;
mod sampler;
mod tile;
mod traversal;
mod watertight;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use crate::scene::{Pose, Scene, View};
use crate::{Error, Result};
use camera::Camera;
use film::{Film, Row, next_check};
use integrator::Integrator;
use sampler::Sampler;

/// Changes whenever the same options could give another image: cached references of other versions are not used.
pub const VERSION: u32 = 2;

/// How much indirect light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// All of it.
    Full,
    /// Emission and direct light, then exactly so many indirect bounces.
    Bounces(u32),
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// At so many samples per pixel.
    Samples(u32),
    /// At the first of [`film::next_check`]'s counts at which [`Film::noise`] is at most this.
    Noise(f64),
}

/// What to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub width: u32,
    pub height: u32,
    pub depth: Depth,
    pub stop: Stop,
    pub seed: u64,
    /// Whether to trace the `ao` layer too.
    pub occlusion: bool,
}

/// How far a render got.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Paths done: when this call began, by now, and expected in the end.
    pub before: u64,
    pub paths: u64,
    pub expected: u64,
    /// As last estimated.
    pub noise: Option<f64>,
}

impl Stop {
    /// Whether a film holds exactly what is asked for.
    pub fn reached(self, film: &Film) -> bool {
        film.done() == film.started() && self.end(film) == Some(film.done())
    }

    /// Whether a film has gone too far to still stop here.
    pub fn passed(self, film: &Film) -> bool {
        match self {
            Self::Samples(n) => film.started() > n,
            Self::Noise(_) => self.end(film).is_some_and(|n| film.started() > n),
        }
    }

    /// The count at which to stop, once known.
    fn end(self, film: &Film) -> Option<u32> {
        match self {
            Self::Samples(n) => Some(n),
            Self::Noise(most) => film.history.iter().find(|(_, noise)| *noise <= most).map(|(n, _)| *n),
        }
    }

    /// The count at which to stop, as far as can be told from the noise so far, which falls with its square root.
    fn expected(self, film: &Film) -> u32 {
        match (self, film.history.last()) {
            (Self::Samples(n), _) => n,
            (Self::Noise(most), Some((n, noise))) => (*n as f64 * (noise / most).powi(2)).clamp(1.0, 1e9) as u32,
            (Self::Noise(_), None) => next_check(0),
        }
    }
}

/// Brings `film` to where `options` want it, on all threads. `progress` is called before the
/// first path and then now and then from any of them; `pause`
/// after some seconds of work, with the film in a state to keep. [`Error::Interrupted`] soon after `cancel` is set.
pub fn render(
    (scene, pose, view): (&Scene, &Pose, &View),
    options: &Options,
    film: &mut Film,
    progress: &(dyn Fn(Progress) + Sync),
    pause: &mut dyn FnMut(&Film) -> Result<()>,
    cancel: &AtomicBool,
) -> Result<()> {
    let bounces = match options.depth {
        Depth::Full => u32::MAX,
        Depth::Bounces(n) => n,
    };
    let integrator = Integrator::new(scene, pose, bounces, options.occlusion);
    let camera = Camera::new(view, &integrator.geometry.units, options.width, options.height);
    let before = film.paths();
    let progress = |paths, expected, noise| progress(Progress { before, paths, expected, noise });
    if !options.stop.reached(film) {
        progress(before, before.max(1), None);
    }
    while !options.stop.reached(film) {
        let check = next_check(film.done());
        let end = options.stop.end(film).map_or(check, |n| check.min(n));
        // A pass of about two million paths lasts some seconds.
        let target = end.min(film.done() + (2_000_000 / (options.width * options.height)).max(1));
        pass(&integrator, &camera, options, film, target, &progress, cancel);
        if film.done() == check {
            film.history.push((check, film.noise()));
        }
        pause(film)?;
        if cancel.load(Ordering::Relaxed) && !options.stop.reached(film) {
            return Err(Error::Interrupted);
        }
    }
    Ok(())
}

/// Brings every row to `target` samples, or stops between rows of tiles.
fn pass(
    integrator: &Integrator,
    camera: &Camera,
    options: &Options,
    film: &mut Film,
    target: u32,
    progress: &(dyn Fn(u64, u64, Option<f64>) + Sync),
    cancel: &AtomicBool,
) {
    let pixels = options.width as u64 * options.height as u64;
    let noise = film.history.last().map(|(_, noise)| *noise);
    let expected = pixels * options.stop.expected(film).max(target) as u64;
    let paths = AtomicU64::new(film.paths());
    film.rows.par_chunks_mut(tile::SIDE).enumerate().for_each(|(i, rows)| {
        let done = rows[0].done;
        if cancel.load(Ordering::Relaxed) || done >= target {
            return;
        }
        for x in (0..options.width as usize).step_by(tile::SIDE) {
            for index in done..target {
                trace_tile(integrator, camera, options.seed, rows, [x, i * tile::SIDE], index);
            }
        }
        rows.iter_mut().for_each(|row| row.done = target);
        let added = (target - done) as u64 * options.width as u64 * rows.len() as u64;
        let paths = paths.fetch_add(added, Ordering::Relaxed) + added;
        progress(paths, expected, noise);
    });
}

/// Adds sample number `index` to the pixels of a tile whose upper left corner is `corner`; `rows` are the tile's.
fn trace_tile(integrator: &Integrator, camera: &Camera, seed: u64, rows: &mut [Row], corner: [usize; 2], index: u32) {
    let columns = tile::SIDE.min(rows[0].pixels.len() - corner[0]);
    let pixels: Vec<_> = (0..rows.len()).flat_map(|y| (0..columns).map(move |x| (corner[0] + x, y))).collect();
    let (mut rays, mut samplers) = (Vec::with_capacity(pixels.len()), Vec::with_capacity(pixels.len()));
    for &(x, row) in &pixels {
        let y = corner[1] + row;
        let sampler = Sampler::new(seed, x as u32, y as u32, index);
        let [u, v, ..] = sampler.set(integrator::PIXEL_AND_LIGHT);
        rays.push(camera.ray(x as f32 + u, y as f32 + v));
        samplers.push(sampler);
    }
    let samples = integrator.trace(&rays, &mut samplers);
    for ((&(x, y), ray), mut sample) in pixels.iter().zip(&rays).zip(samples) {
        if !(sample.beauty.is_finite() && sample.direct.is_finite()) {
            rows[y].rejected += 1;
            (sample.beauty, sample.direct) = Default::default();
        }
        let depth = sample.first.map_or(0.0, |first| camera.depth(ray, first.distance));
        rows[y].pixels[x].add(&sample, index, depth);
    }
}
