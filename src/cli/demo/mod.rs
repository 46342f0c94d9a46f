//! `twobounce demo`: a sequence with motion of every kind, in the window, as images, or as a benchmark.

mod benchmark;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use twobounce::assets::DEMO_S;
use twobounce::output::picture::ImageKind;

use super::args::{Frames, Loop, RunArgs, SceneArgs, SettingsArgs, number, size};
use super::display::DisplayArgs;
use super::refine::RefineArgs;
use super::render::{self, RenderArgs};
use super::scene::DEMO;

#[derive(Args, Debug)]
#[command(mut_arg("preset", |preset| preset.default_value("fast")))]
#[command(mut_arg("exposure", |exposure| exposure.default_value(EXPOSURE_EV)))]
pub struct DemoArgs {
    /// Write images instead: a pattern such as out_%04d.png
    #[arg(short, long, value_name = "OUT_%04d.png")]
    pub output: Option<PathBuf>,
    /// Time every pass over the whole sequence, and print minimum, median and 99th percentile
    #[arg(long, conflicts_with = "output")]
    pub benchmark: bool,
    /// Write the results of --benchmark as JSON; - is standard output
    #[arg(long, value_name = "FILE", requires = "benchmark")]
    pub json: Option<PathBuf>,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: (u32, u32),
    /// Images or measured frames per second of the sequence
    #[arg(long, value_name = "F", default_value_t = 30.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n > 0.0 && n <= 1e4, "write frames per second, above 0 and at most 10000"))]
    pub fps: f64,
    #[command(flatten)]
    pub display: DisplayArgs,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Play the acts of this file in the window, line by line; for tests
    #[arg(long, value_name = "FILE", hide = true)]
    pub script: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// This exposure shows both rooms: the first image only shows the dark one, and would choose too high an exposure.
const EXPOSURE_EV: &str = "0.5";

pub fn run(args: &DemoArgs) -> anyhow::Result<ExitCode> {
    let scene = SceneArgs { repeats: Loop::On, ..SceneArgs::plain(Path::new(DEMO), args.size) };
    let frames = (DEMO_S * args.fps).round().max(1.0) as u32;
    match &args.output {
        _ if args.benchmark => benchmark::run(args, &scene, frames),
        Some(output) => render::run(&images(args, scene, output, frames)),
        None => window(args, scene),
    }
}

fn images(args: &DemoArgs, scene: SceneArgs, output: &Path, frames: u32) -> RenderArgs {
    let exr = ImageKind::of_path(output) == Some(ImageKind::Exr);
    RenderArgs {
        scene,
        output: output.to_owned(),
        settings: args.settings.clone(),
        aov: vec![],
        transparent: false,
        display: if exr { DisplayArgs::default() } else { args.display.clone() },
        repeat: 1,
        still: false,
        frames: Some(Frames { first: 0, last: frames - 1, step: 1 }),
        list: None,
        fps: args.fps,
        speed: 1.0,
        refine: RefineArgs::default(),
        timings: false,
        verbose: false,
        quiet: false,
        json: None,
        trace: None,
        run: args.run.clone(),
    }
}

#[cfg(feature = "window")]
fn window(args: &DemoArgs, scene: SceneArgs) -> anyhow::Result<ExitCode> {
    let view = super::view::ViewArgs {
        scene,
        settings: args.settings.clone(),
        display: args.display.clone(),
        play: true,
        refine: 64,
        #[cfg(feature = "hot-reload")]
        glsl: None,
        script: args.script.clone(),
        run: args.run.clone(),
    };
    let typed = [DEMO, "--loop=on"].into_iter().map(str::to_owned).chain(std::env::args().skip(2));
    super::view::run(&view, typed.collect(), "twobounce demo -o out_%04d.png")
}

#[cfg(not(feature = "window"))]
fn window(_: &DemoArgs, _: SceneArgs) -> anyhow::Result<ExitCode> {
    Err(anyhow::anyhow!("this build has no window: write images with -o out_%04d.png, or measure with --benchmark"))
}
