//! The reference: an unbiased path tracer on the CPU. It shares only the scene and its materials with the renderer.
//!
//! [`render`] adds samples to a [`Film`] until [`Options::stop`]; [`cache::Cache`] keeps films between runs. One kind
//! of light is missing, because such paths cannot be sampled from the camera: caustics of point lights without extent.

mod bsdf;
#[cfg(test)]
mod bsdf_tests;
mod bvh;
pub mod cache;
mod camera;
pub mod film;
mod geometry;
mod integrator;
mod itself;
mod lanes;
mod layers;
mod lights;
mod material;
mod memory;
mod microfacet;
pub mod part;
mod point_textures;
mod sampler;
mod sky;
mod sum;
mod thin_film;
mod tile;
mod traversal;
mod watertight;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use crate::scene::{Still, View};
use crate::{Error, Result};
use camera::Camera;
use film::{Film, PixelRow, next_check};
use integrator::Integrator;
pub use itself::lights_itself;
use sampler::Sampler;
use tile::Tiles;

/// This number must change whenever equal options could give another image: cached references of other versions are
/// ignored.
pub const VERSION: u32 = 5;

/// The number of bounces of indirect light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Unlimited.
    Full,
    /// Emission, direct light and this number of indirect bounces.
    Bounces(u32),
}

/// The condition at which a render is finished.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// This number of samples per pixel.
    Samples(u32),
    /// The samples in this range of numbers: a part of an image.
    Range { first: u32, end: u32 },
    /// The first count of [`film::next_check`] at which [`Film::noise`] is at most this.
    Noise(f64),
    /// Any film whose noise is at most `noise`, but no more samples than [`Self::Noise`] with `last`: an intermediate
    /// step.
    Rough { noise: f64, last: f64 },
}

/// The parameters of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub width: u32,
    pub height: u32,
    pub depth: Depth,
    pub stop: Stop,
    pub seed: u64,
    /// Whether to trace the `ao` layer.
    pub occlusion: bool,
}

/// The progress of a render.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Paths in the film when the call began, now, and expected at the end.
    pub before: u64,
    pub paths: u64,
    pub expected: u64,
    /// The last estimate.
    pub noise: Option<f64>,
}

/// The caller's part in a running render.
pub struct Control<'a> {
    /// Called before the first path, and then repeatedly from any thread.
    pub progress: &'a (dyn Fn(Progress) + Sync),
    /// Called every few seconds, when all rows of the film have the same number of samples or `cancel` is set.
    pub save: &'a mut dyn FnMut(&Film) -> Result<()>,
    /// Ends the render soon after it is set.
    pub cancel: &'a AtomicBool,
}

impl Stop {
    /// Number of the first sample.
    pub fn first(self) -> u32 {
        match self {
            Self::Range { first, .. } => first,
            _ => 0,
        }
    }

    /// Whether a film is finished.
    pub fn reached(self, film: &Film) -> bool {
        let noise_now = film.history.last().map(|(_, noise)| *noise);
        let enough = matches!(self, Self::Rough { noise, .. } if noise_now.is_some_and(|now| now <= noise));
        film.done() == film.started() && (self.end(film) == Some(film.done()) || enough)
    }

    /// Whether a film has more samples than a finished one.
    pub fn passed(self, film: &Film) -> bool {
        self.end(film).is_some_and(|n| film.started() > n)
    }

    /// The final count of samples, once known.
    fn end(self, film: &Film) -> Option<u32> {
        match self {
            Self::Samples(n) => Some(n),
            Self::Range { first, end } => Some(end - first),
            Self::Noise(most) | Self::Rough { last: most, .. } => {
                film.history.iter().find(|(_, noise)| *noise <= most).map(|(n, _)| *n)
            }
        }
    }

    /// The expected final number of samples: noise is proportional to the inverse square root of it.
    fn expected(self, film: &Film) -> u32 {
        match (self, film.history.last()) {
            (Self::Samples(n), _) => n,
            (Self::Range { first, end }, _) => end - first,
            (Self::Noise(most) | Self::Rough { noise: most, .. }, Some((n, noise))) => {
                (*n as f64 * (noise / most).powi(2)).clamp(1.0, 1e9) as u32
            }
            (Self::Noise(_) | Self::Rough { .. }, None) => next_check(0),
        }
    }
}

/// Adds samples to `film` until `options.stop`, on all threads.
///
/// # Errors
/// [`Error::Interrupted`] if `control.cancel` is set before; [`Error::Usage`] for a scene or a pose that
/// [`Scene::check`](crate::scene::Scene::check) or [`Pose::check`](crate::scene::Pose::check) refuses.
pub fn render(seen: Still, options: &Options, film: &mut Film, control: Control) -> Result<()> {
    trace(&integrator(seen, options)?, seen.view, options, film, control)
}

/// Makes a scene ready to trace.
fn integrator<'a>(Still { scene, pose, .. }: Still<'a>, options: &Options) -> Result<Integrator<'a>> {
    scene.check()?;
    pose.check(scene)?;
    Ok(Integrator::new(scene, pose, options))
}

/// As [`render`], for a prepared scene.
fn trace(integrator: &Integrator, view: &View, options: &Options, film: &mut Film, control: Control) -> Result<()> {
    let Control { progress, save, cancel } = control;
    let camera = Camera::new(view, &integrator.geometry().units, options.width, options.height);
    film.first = options.stop.first();
    let before = film.paths();
    let progress = |paths, expected, noise| progress(Progress { before, paths, expected, noise });
    let job = ActiveRender { integrator, camera, options, progress: &progress, cancel };
    if !options.stop.reached(film) {
        progress(before, before.max(1), None);
    }
    while !options.stop.reached(film) {
        let check = next_check(film.done());
        let end = options.stop.end(film).map_or(check, |n| check.min(n));
        // A pass of about two million paths takes some seconds.
        let target = end.min(film.done() + (2_000_000 / (options.width * options.height)).max(1));
        job.pass(film, target);
        if film.done() == check {
            film.history.push((check, film.noise()));
        }
        save(film)?;
        if cancel.load(Ordering::Relaxed) && !options.stop.reached(film) {
            return Err(Error::Interrupted);
        }
    }
    Ok(())
}

/// A running render.
struct ActiveRender<'a> {
    integrator: &'a Integrator<'a>,
    camera: Camera,
    options: &'a Options,
    /// Receives the paths so far, the expected paths and the noise.
    progress: &'a (dyn Fn(u64, u64, Option<f64>) + Sync),
    cancel: &'a AtomicBool,
}

impl ActiveRender<'_> {
    /// Renders every row up to `target` samples per pixel. After `cancel` is set, unfinished rows stay as they were.
    fn pass(&self, film: &mut Film, target: u32) {
        let Options { width, height, stop, .. } = *self.options;
        let noise = film.history.last().map(|(_, noise)| *noise);
        let expected = u64::from(width) * u64::from(height) * u64::from(stop.expected(film).max(target));
        let (first, paths) = (film.first, AtomicU64::new(film.paths()));
        while film.done() < target && !self.cancel.load(Ordering::Relaxed) {
            let tiles = Tiles::from_tile(first + film.done());
            let target = target.min(tiles.end - first);
            tiles.rows(&mut film.rows).for_each(|(y, rows)| {
                let done = rows[0].done;
                if self.cancel.load(Ordering::Relaxed) || done >= target {
                    return;
                }
                let before = rows.to_vec();
                for (x, columns) in tiles.columns(width as usize) {
                    for index in done..target {
                        if self.cancel.load(Ordering::Relaxed) {
                            rows.clone_from_slice(&before);
                            return;
                        }
                        self.trace_tile(rows, [x, y], columns, first + index);
                    }
                }
                rows.iter_mut().for_each(|row| row.done = target);
                let added = u64::from(target - done) * u64::from(width) * rows.len() as u64;
                let paths = paths.fetch_add(added, Ordering::Relaxed) + added;
                (self.progress)(paths, expected, noise);
            });
        }
    }

    /// Adds sample number `index` to the pixels of a tile, which is `columns` pixels wide and contains all of `rows`.
    /// Its upper left corner is at `corner`.
    fn trace_tile(&self, rows: &mut [PixelRow], corner: [usize; 2], columns: usize, index: u32) {
        let pixels: Vec<_> = (0..rows.len()).flat_map(|y| (0..columns).map(move |x| (corner[0] + x, y))).collect();
        let (mut rays, mut samplers) = (Vec::with_capacity(pixels.len()), Vec::with_capacity(pixels.len()));
        for &(x, row) in &pixels {
            let y = corner[1] + row;
            let sampler = Sampler::new(self.options.seed, x as u32, y as u32, index);
            let [u, v, ..] = sampler.set(integrator::PIXEL_AND_LIGHT);
            rays.push(self.camera.ray(x as f32 + u, y as f32 + v));
            samplers.push(sampler);
        }
        let samples = self.integrator.trace(&rays, &mut samplers);
        for ((&(x, y), ray), mut sample) in pixels.iter().zip(&rays).zip(samples) {
            if !(sample.beauty.is_finite() && sample.direct.is_finite()) {
                rows[y].rejected += 1;
                (sample.beauty, sample.direct) = Default::default();
            }
            let depth = sample.first.map_or(0.0, |first| self.camera.depth(ray, first.distance));
            rows[y].pixels[x].add(&sample, index, depth);
        }
    }
}
