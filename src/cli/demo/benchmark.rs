//! What each pass takes over the whole sequence, to be quoted.

use std::process::ExitCode;
use std::time::Instant;

use serde::Serialize;
use twobounce::assets::DEMO_S;
use twobounce::measure::refuse_invalid;
use twobounce::output::file;
use twobounce::profile::WARM_UP;
use twobounce::renderer::{FrameReport, Renderer};
use twobounce::settings::Settings;
use twobounce::vk::ZoneKind;

use super::DemoArgs;
use crate::cli::args::SceneArgs;
use crate::cli::progress::{Work, left};
use crate::cli::{interrupt, out, outputs, report};

/// The version of the JSON. It must grow when a key is new or changes its name, unit or meaning.
const VERSION: u32 = 1;

/// Milliseconds: minimum, median and 99th percentile, each of one frame (nearest rank).
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
struct Percentiles {
    min: f64,
    median: f64,
    p99: f64,
}

#[derive(Serialize)]
struct Pass {
    name: &'static str,
    kind: ZoneKind,
    /// In which the pass ran.
    frames: usize,
    gpu_ms: Percentiles,
}

/// What `--json` writes; `docs/json.md` documents the keys.
#[derive(Serialize)]
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
    passes: Vec<Pass>,
    method: &'static str,
    settings: Settings,
}

/// Renders the sequence without writing it. The frames to warm up are its end, from which it begins anew: something moves in each.
pub fn run(args: &DemoArgs, scene: &SceneArgs, count: u32) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    outputs::check(&[args.settings.config.as_ref()], &[args.json.as_ref()])?;
    interrupt::install()?;
    let (opened, context) = scene.open_on(&args.run)?;
    let (pose, _) = opened.at_time();
    let options = opened.run_options(&args.run);
    let work = Work::begin("demo: making passes");
    let mut renderer = Renderer::new(&context, opened.scene, &pose, settings.clone(), options)?;
    report::say_compiled(&context);
    let (all, began, mut frames) = (WARM_UP + count, Instant::now(), vec![]);
    for frame in 0..all {
        interrupt::check()?;
        let left = left(began.elapsed(), frame.into(), all.into());
        work.is_at(format!("demo, frame {} of {all}", frame + 1), left);
        let later_s = DEMO_S + (f64::from(frame) - f64::from(WARM_UP)) / args.fps;
        let pose = opened.shot.pose(renderer.scene(), later_s);
        let view = opened.shot.view(renderer.scene(), &pose);
        frames.push(renderer.render(&pose, &view)?);
    }
    drop(work);
    refuse_invalid(&context)?;
    let frames = &frames[WARM_UP as usize..];
    let report = Report {
        version: VERSION,
        program: format!("twobounce {}", env!("CARGO_PKG_VERSION")),
        device: context.name.clone(),
        driver: context.driver.clone(),
        width: args.size.0,
        height: args.size.1,
        fps: args.fps,
        frames: frames.len(),
        frame_wall_ms: Percentiles::of(frames.iter().map(|frame| frame.timings.wall_ms)),
        frame_gpu_ms: Percentiles::of(frames.iter().map(|frame| frame.timings.gpu_ms)),
        passes: passes(frames),
        method: settings.method.name(),
        settings,
    };
    out::write(&report.table(&args.settings.preset));
    if let Some(path) = &args.json {
        file::write_json(path, &report)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Percentiles {
    /// All zero without values.
    fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * values.len() as f64).ceil().max(1.0) as usize;
            values.get(rank - 1).copied().unwrap_or_default()
        };
        Self { min: at(0.0), median: at(0.5), p99: at(0.99) }
    }
}

/// In the order in which they first ran; what runs several times in a frame is added.
fn passes(frames: &[FrameReport]) -> Vec<Pass> {
    let mut passes: Vec<(&'static str, ZoneKind, Vec<f64>)> = vec![];
    for frame in frames {
        let mut of_frame: Vec<(&'static str, ZoneKind, f64)> = vec![];
        for zone in &frame.timings.zones {
            match of_frame.iter_mut().find(|(name, kind, _)| (*name, *kind) == (zone.name, zone.kind)) {
                Some((_, _, ms)) => *ms += zone.gpu_ms,
                None => of_frame.push((zone.name, zone.kind, zone.gpu_ms)),
            }
        }
        for (name, kind, ms) in of_frame {
            match passes.iter_mut().find(|pass| (pass.0, pass.1) == (name, kind)) {
                Some((_, _, all)) => all.push(ms),
                None => passes.push((name, kind, vec![ms])),
            }
        }
    }
    let pass = |(name, kind, ms): (_, _, Vec<f64>)| Pass { name, kind, frames: ms.len(), gpu_ms: Percentiles::of(ms) };
    passes.into_iter().map(pass).collect()
}

impl Report {
    /// A table in Markdown, with all that one must know to compare it.
    fn table(&self, preset: &str) -> String {
        let Self { program, device, driver, width, height, fps, frames, .. } = self;
        let line = |name: &str, kind: &str, ms: &Percentiles| {
            format!("| {name} | {kind} | {:.3} | {:.3} | {:.3} |\n", ms.min, ms.median, ms.p99)
        };
        let passes =
            self.passes.iter().map(|pass| line(pass.name, &format!("{:?}", pass.kind).to_lowercase(), &pass.gpu_ms));
        format!(
            "{program}, demo, {frames} frames at {fps} a second, {width}x{height}, preset {preset}, {} voxels a side, {device} ({driver})\n\n\
             | pass | kind | min ms | median ms | 99th percentile ms |\n|---|---|---|---|---|\n{}{}{}",
            self.settings.voxels,
            passes.collect::<String>(),
            line("frame", "device", &self.frame_gpu_ms),
            line("frame", "wall clock", &self.frame_wall_ms),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let hundred = Percentiles::of((1..=200).rev().map(f64::from));
        assert_eq!(hundred, Percentiles { min: 1.0, median: 100.0, p99: 198.0 });
        assert_eq!(Percentiles::of([7.0]), Percentiles { min: 7.0, median: 7.0, p99: 7.0 });
        assert_eq!(Percentiles::of([]), Percentiles { min: 0.0, median: 0.0, p99: 0.0 });
    }
}
