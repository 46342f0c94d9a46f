//! A camera's flight through a still scene: what changes from frame to frame beyond what the path tracer's frames change, over the
//! reference's mean, and over the worst hundredth of the pixels. `docs/study/rooms/README.md` says what was found.
//!
//! `cargo run --release --example flight -- SCENE [--size WxH] [--preset NAME] [--frames N] [--every K] [--samples N] [KEY=VALUE …]
//! --way X,Y,Z:X,Y,Z …` prints CSV, a line for each compared pair of frames. `--way`: an eye and what it looks at, two or more, with
//! straight lines between them. All frames are rendered, one after the other; each K-th and the one after it are compared.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use twobounce::chart::measure::same_depth;
use twobounce::ground::clearance::for_camera;
use twobounce::layers::Layers;
use twobounce::measure::refuse_invalid;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LoadOptions, Scene, Still, View};
use twobounce::settings::Settings;
use twobounce::stability::motion::{excess, mean};
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

struct Flight {
    scene: PathBuf,
    size: (u32, u32),
    settings: Settings,
    frames: usize,
    every: usize,
    samples: u32,
    /// Eye and target.
    way: Vec<(DVec3, DVec3)>,
}

fn main() -> Result<()> {
    let flight = Flight::of_arguments()?;
    let scene = Scene::load(&flight.scene, &LoadOptions::default())?;
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let context = Context::new(&ContextOptions::default())?;
    let settings = for_camera(&flight.settings, Still::new(&scene, &pose, &flight.view(0)), bounds);
    let (cancel, cache) = (AtomicBool::new(false), Cache::of_user());
    let depth = same_depth(&scene, &settings);
    let truth = |view: &View, seed| {
        let (width, height) = flight.size;
        let stop = Stop::Samples(flight.samples);
        let options = Options { width, height, depth, stop, seed, occlusion: false };
        Ok::<_, Error>(cache.render(Still::new(&scene, &pose, view), &options, &|_| {}, &cancel)?.layers(&[]))
    };
    let mut renderer =
        Renderer::new(&context, scene.clone(), &pose, settings, RenderOptions::new(flight.size, bounds))?;
    println!("frame,change,reference's change,excess,worst hundredth,of the reference's noise,its worst hundredth");
    let mut before: Option<Layers> = None;
    for frame in 0..flight.frames {
        renderer.render(&pose, &flight.view(frame))?;
        refuse_invalid(&context)?;
        let image = renderer.read();
        let compared = frame > 0 && (frame - 1) % flight.every == 0;
        if let Some(before) = before.filter(|_| compared) {
            let series = |seed| [frame - 1, frame].map(|frame| truth(&flight.view(frame), seed));
            let ([a, b], [c, d]) = (series(0), series(1));
            let (one, other) = ([a?, b?], [c?, d?]);
            let both = [0, 1].map(|i| mean(&one[i], &other[i]));
            let frames = [before, image.clone()];
            let (all, worst) = excess(&frames, &both)?;
            // Half the difference of two has the error's distribution of their mean.
            let (noise, worst_noise) = excess(&one, &other)?;
            let still = [both[0].clone(), both[0].clone()];
            let (change, _) = excess(&frames, &still)?;
            let (true_change, _) = excess(&both, &still)?;
            println!(
                "{frame},{change:.4},{true_change:.4},{all:.4},{worst:.4},{:.4},{:.4}",
                0.5 * noise,
                0.5 * worst_noise
            );
        }
        before = Some(image);
    }
    Ok(())
}

impl Flight {
    fn of_arguments() -> Result<Self> {
        let mut words = std::env::args().skip(1);
        let wrong = |word: &str| Error::Usage(format!("{word}: see the first lines of examples/flight.rs"));
        let scene = words.next().ok_or_else(|| wrong("SCENE is missing"))?.into();
        let (mut size, mut preset, mut changes) = ((160, 90), "balanced".to_owned(), Vec::new());
        let (mut frames, mut every, mut samples, mut way) = (300, 10, 256, Vec::new());
        while let Some(word) = words.next() {
            if word.contains('=') {
                changes.push(word);
                continue;
            }
            let value = words.next().ok_or_else(|| wrong(&word))?;
            let number = || value.parse().map_err(|_| wrong(&word));
            match word.as_str() {
                "--size" => {
                    let (width, height) = value.split_once('x').ok_or_else(|| wrong(&word))?;
                    let edge = |text: &str| text.parse().map_err(|_| wrong(&word));
                    size = (edge(width)?, edge(height)?);
                }
                "--preset" => preset = value,
                "--frames" => frames = number()?,
                "--every" => every = number()?.max(1),
                "--samples" => samples = number()? as u32,
                "--way" => {
                    let (eye, target) = value.split_once(':').ok_or_else(|| wrong(&word))?;
                    way.push((point(eye).ok_or_else(|| wrong(&word))?, point(target).ok_or_else(|| wrong(&word))?));
                }
                _ => return Err(wrong(&word)),
            }
        }
        if way.len() < 2 || frames < 2 {
            return Err(wrong("--way is there less than twice, or --frames is below 2"));
        }
        let mut settings = Settings::preset(&preset)?;
        changes.iter().try_for_each(|change| settings.set(change))?;
        Ok(Self { scene, size, settings, frames, every, samples, way })
    }

    fn view(&self, frame: usize) -> View {
        let legs = (self.way.len() - 1) as f64;
        let at = frame as f64 / (self.frames - 1) as f64 * legs;
        let leg = (at as usize).min(self.way.len() - 2);
        let ((eye, target), (next_eye, next_target), part) = (self.way[leg], self.way[leg + 1], at - leg as f64);
        View::look_at(eye.lerp(next_eye, part), target.lerp(next_target, part), DVec3::Y, 60f32.to_radians())
    }
}

fn point(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
    <[f64; 3]>::try_from(numbers).ok().map(DVec3::from)
}
