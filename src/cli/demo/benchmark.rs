//! Times of each pass over the whole sequence.

use std::process::ExitCode;

use serde::Serialize;
use twobounce::assets::DEMO_S;
use twobounce::lab::table::markdown;
use twobounce::measure::refuse_invalid;
use twobounce::measure::timing::{PassTiming, Percentiles, Timings};
use twobounce::output::file;
use twobounce::profile::WARM_UP;
use twobounce::renderer::Renderer;
use twobounce::settings::Settings;
use twobounce::vk::ZoneKind;

use super::DemoArgs;
use crate::cli::args::SceneArgs;
use crate::cli::progress::{FrameProgress, Work};
use crate::cli::scene::{fitted, run_options};
use crate::cli::{interrupt, out, outputs, report};

/// The version of the JSON. It increases when a key is new or changes its name, unit or meaning.
const VERSION: u32 = 1;

#[derive(Serialize)]
struct PassTimes {
    name: &'static str,
    kind: ZoneKind,
    /// The number of frames in which the pass ran.
    frames: usize,
    gpu_ms: Percentiles,
}

/// The report of `--json`; `docs/json.md` documents the keys.
#[derive(Default, Serialize)]
struct Report {
    version: u32,
    program: String,
    device: String,
    driver: String,
    width: u32,
    height: u32,
    fps: f64,
    frames: usize,
    frame_wall_ms: Percentiles,
    frame_gpu_ms: Percentiles,
    passes: Vec<PassTimes>,
    method: &'static str,
    settings: Settings,
}

/// Renders the sequence without writing it. The warm-up frames are its end, from which it restarts, so that something
/// moves in each frame.
pub fn run(args: &DemoArgs, scene: &SceneArgs, count: u32) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    outputs::check(&[args.settings.config.as_ref()], &[args.json.as_ref()])?;
    interrupt::install()?;
    let (opened, context) = scene.open_on(&args.run)?;
    let settings = fitted(&opened, settings);
    let options = run_options(&opened, &args.run);
    let work = Work::begin("demo: preparing");
    let mut renderer = Renderer::new(&context, opened.scene, &opened.still.0, settings.clone(), options)?;
    report::say_compiled(&context);
    let (mut progress, mut timings) = (FrameProgress::new(work, WARM_UP + count), Timings::new(WARM_UP as usize));
    for frame in 0..WARM_UP + count {
        interrupt::check()?;
        progress.begin("demo", renderer.bands());
        let later_s = DEMO_S + (f64::from(frame) - f64::from(WARM_UP)) / args.fps;
        let (pose, view) = opened.shot.at(renderer.scene(), later_s);
        timings.push(renderer.render(&pose, &view)?);
        progress.finish();
    }
    drop(progress);
    refuse_invalid(&context)?;
    let pass = |PassTiming { name, kind, frames_gpu_ms, .. }: PassTiming| PassTimes {
        name,
        kind,
        frames: frames_gpu_ms.len(),
        gpu_ms: Percentiles::of_values(frames_gpu_ms),
    };
    let report = Report {
        version: VERSION,
        program: format!("twobounce {}", env!("CARGO_PKG_VERSION")),
        device: context.name.clone(),
        driver: context.driver.clone(),
        width: args.size.0,
        height: args.size.1,
        fps: args.fps,
        frames: timings.frames().len(),
        frame_wall_ms: Percentiles::of_values(timings.frames().map(|frame| frame.wall_ms)),
        frame_gpu_ms: Percentiles::of_values(timings.frames().map(|frame| frame.gpu_ms)),
        passes: timings.passes().into_iter().map(pass).collect(),
        method: settings.method.name(),
        settings,
    };
    out::write(&report.table(&args.settings.preset));
    if let Some(path) = &args.json {
        file::write_json(path, &report)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Report {
    /// A Markdown table with all conditions for a comparison.
    fn table(&self, preset: &str) -> String {
        let Self { program, device, driver, width, height, fps, frames, .. } = self;
        let kind = |kind: ZoneKind| format!("{kind:?}").to_lowercase();
        let passes = self.passes.iter().map(|pass| (pass.name, kind(pass.kind), pass.gpu_ms));
        let frame = [("device", self.frame_gpu_ms), ("wall clock", self.frame_wall_ms)];
        let rows = passes.chain(frame.map(|(kind, ms)| ("frame", kind.to_owned(), ms)));
        let rows = rows.map(|(name, kind, ms)| {
            let [min, median, p99] = [ms.min, ms.median, ms.p99].map(|ms| format!("{ms:.3}"));
            [name.to_owned(), kind, min, median, p99]
        });
        let head = ["pass", "kind", "min ms", "median ms", "99th percentile ms"];
        let voxels = self.settings.voxels;
        format!(
            "{program}, demo, {frames} frames at {fps} a second, {width}x{height}, preset {preset}, {voxels} voxels a side, {device} ({driver})\n\n{}",
            markdown(head, "-", rows)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_are_those_of_the_page() {
        let pass = PassTimes { name: "record", kind: ZoneKind::Raster, frames: 1, gpu_ms: Percentiles::default() };
        let report = Report { passes: vec![pass], ..Report::default() };
        report::tests::assert_documented(&report, VERSION, "The file that `twobounce demo", &["settings"]);
    }
}
