//! A camera's flight through a still scene: the change from frame to frame beyond the change of the path tracer's
//! frames, over the reference's mean, and over the worst hundredth of the pixels. `docs/notes/study/rooms/README.md`
//! has the results.
//!
//! The output is CSV, a line for each compared pair of frames. All frames are rendered, one after the other; each K-th
//! one and the next are compared.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::Args;
use glam::DVec3;
use twobounce::chart::measure::same_depth;
use twobounce::ground::grid_choice::for_camera;
use twobounce::lab::specimen::Specimen;
use twobounce::layers::Layers;
use twobounce::measure::refuse_invalid;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Options, Stop};
use twobounce::scene::{Still, View};
use twobounce::settings::Settings;
use twobounce::stability::motion::{excess, mean};
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

#[derive(Args)]
pub struct Flight {
    scene: PathBuf,
    /// Changes of settings: KEY=VALUE
    changes: Vec<String>,
    #[arg(long, default_value = "160x90", value_parser = size)]
    size: (u32, u32),
    #[arg(long, default_value = "balanced")]
    preset: String,
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    #[arg(long, default_value_t = 256)]
    samples: u32,
    /// An eye and its target, X,Y,Z:X,Y,Z; given twice or more, with straight lines between them
    #[arg(long, required = true, allow_hyphen_values = true, value_parser = eye_and_target)]
    way: Vec<(DVec3, DVec3)>,
}

fn size(text: &str) -> std::result::Result<(u32, u32), &'static str> {
    let read = || Some((text.split_once('x')?.0.parse().ok()?, text.split_once('x')?.1.parse().ok()?));
    read().ok_or("write WxH")
}

fn eye_and_target(text: &str) -> std::result::Result<(DVec3, DVec3), &'static str> {
    let point = |text: &str| -> Option<DVec3> {
        let numbers: Vec<f64> = text.split(',').map(|n| n.parse().ok()).collect::<Option<_>>()?;
        <[f64; 3]>::try_from(numbers).ok().map(DVec3::from)
    };
    text.split_once(':').and_then(|(eye, target)| Some((point(eye)?, point(target)?))).ok_or("write X,Y,Z:X,Y,Z")
}

impl Flight {
    pub fn run(&self) -> Result<()> {
        if self.way.len() < 2 {
            return Err(Error::Usage("--way: name it for two points at least".into()));
        }
        let mut settings = Settings::preset(&self.preset)?;
        self.changes.iter().try_for_each(|change| settings.set(change))?;
        let specimen = Specimen { view: self.view(0), ..Specimen::load(&self.scene)? };
        let Specimen { scene, pose, .. } = &specimen;
        let context = Context::new(&ContextOptions::default())?;
        let options = specimen.options(self.size);
        let settings = for_camera(&settings, specimen.still(), options.bounds);
        let (cancel, cache) = (AtomicBool::new(false), Cache::of_user());
        let depth = same_depth(scene, &settings);
        let truth = |view: &View, seed| {
            let (width, height) = self.size;
            let stop = Stop::Samples(self.samples);
            let options = Options { width, height, depth, stop, seed, occlusion: false };
            Ok::<_, Error>(cache.render(Still::new(scene, pose, view), &options, &|_| {}, &cancel)?.layers(&[]))
        };
        let mut renderer = specimen.renderer(&context, &settings, options)?;
        println!("frame,change,reference's change,excess,worst hundredth,of the reference's noise,its worst hundredth");
        let mut before: Option<Layers> = None;
        for frame in 0..self.frames {
            renderer.render(pose, &self.view(frame))?;
            refuse_invalid(&context)?;
            let image = renderer.read();
            let compared = frame > 0 && (frame - 1) % self.every == 0;
            if let Some(before) = before.filter(|_| compared) {
                let series = |seed| [frame - 1, frame].map(|frame| truth(&self.view(frame), seed));
                let ([a, b], [c, d]) = (series(0), series(1));
                let (one, other) = ([a?, b?], [c?, d?]);
                let both = [0, 1].map(|i| mean(&one[i], &other[i]));
                let frames = [before, image.clone()];
                let (all, worst) = excess(&frames, &both)?;
                // Half the difference of two independent images is distributed like the error of their mean.
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

    fn view(&self, frame: u32) -> View {
        let legs = (self.way.len() - 1) as f64;
        let at = f64::from(frame) / f64::from(self.frames - 1) * legs;
        let leg = (at as usize).min(self.way.len() - 2);
        let ((eye, target), (next_eye, next_target), part) = (self.way[leg], self.way[leg + 1], at - leg as f64);
        View::look_at(eye.lerp(next_eye, part), target.lerp(next_target, part), DVec3::Y, 60f32.to_radians())
    }
}
