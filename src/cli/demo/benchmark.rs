//! What each pass takes over the whole sequence, to be quoted.

use std::process::ExitCode;

use serde::Serialize;
use twobounce::assets::DEMO_S;
use twobounce::measure::refuse_invalid;
use twobounce::measure::timing::{PassTiming, Percentiles, Timings};
use twobounce::output::file;
use twobounce::profile::WARM_UP;
use twobounce::renderer::Renderer;
use twobounce::settings::Settings;
use twobounce::vk::Context;
use twobounce::vk::ZoneKind;

use super::DemoArgs;
use crate::cli::args::SceneArgs;
use crate::cli::progress::{FrameProgress, Work};
use crate::cli::{interrupt, out, outputs, report};

/// The version of the JSON. It must grow when a key is new or changes its name, unit or meaning.
const VERSION: u32 = 1;

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
    let settings = opened.fitted(settings);
    let (pose, _) = opened.at_time();
    let options = opened.run_options(&args.run);
    let work = Work::begin("demo: making passes");
    let mut renderer = Renderer::new(&context, opened.scene, &pose, settings.clone(), options)?;
    report::say_compiled(&context);
    let (mut progress, mut timings) = (FrameProgress::new(work, WARM_UP + count), Timings::new(WARM_UP as usize));
    for frame in 0..WARM_UP + count {
        interrupt::check()?;
        progress.begin("demo", renderer.bands());
        let later_s = DEMO_S + (f64::from(frame) - f64::from(WARM_UP)) / args.fps;
        let pose = opened.shot.pose(renderer.scene(), later_s);
        let view = opened.shot.view(renderer.scene(), &pose);
        timings.push(renderer.render(&pose, &view)?);
        progress.finish();
    }
    drop(progress);
    refuse_invalid(&context)?;
    let report = Report::of(args, settings, &context, &timings);
    out::write(&report.table(&args.settings.preset));
    if let Some(path) = &args.json {
        file::write_json(path, &report)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Report {
    fn of(args: &DemoArgs, settings: Settings, context: &Context, timings: &Timings) -> Self {
        let pass = |PassTiming { name, kind, frames_gpu_ms, .. }: PassTiming| Pass {
            name,
            kind,
            frames: frames_gpu_ms.len(),
            gpu_ms: Percentiles::of(frames_gpu_ms),
        };
        Self {
            version: VERSION,
            program: format!("twobounce {}", env!("CARGO_PKG_VERSION")),
            device: context.name.clone(),
            driver: context.driver.clone(),
            width: args.size.0,
            height: args.size.1,
            fps: args.fps,
            frames: timings.frames().len(),
            frame_wall_ms: Percentiles::of(timings.frames().map(|frame| frame.wall_ms)),
            frame_gpu_ms: Percentiles::of(timings.frames().map(|frame| frame.gpu_ms)),
            passes: timings.passes().into_iter().map(pass).collect(),
            method: settings.method.name(),
            settings,
        }
    }

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
    use std::collections::BTreeSet;

    use super::*;

    /// A key that is renamed, added or dropped must be so in the page too, and its version looked at.
    #[test]
    fn the_keys_are_those_of_the_page() {
        let all = Percentiles { min: 1.0, median: 2.0, p99: 3.0 };
        let pass = Pass { name: "record", kind: ZoneKind::Raster, frames: 1, gpu_ms: all };
        let report = Report {
            version: VERSION,
            program: String::new(),
            device: String::new(),
            driver: String::new(),
            width: 1,
            height: 1,
            fps: 1.0,
            frames: 1,
            frame_wall_ms: all,
            frame_gpu_ms: all,
            passes: vec![pass],
            method: "rays",
            settings: Settings::default(),
        };
        let mut paths = BTreeSet::new();
        report::tests::paths(&serde_json::to_value(report).unwrap(), "", &mut paths);
        // Settings have a page of their own; percentiles are explained once.
        let percentile = |path: &str| {
            ["min", "median", "p99"].iter().find_map(|end| path.strip_suffix(&format!(".{end}")).map(str::to_owned))
        };
        let mut written: BTreeSet<String> = paths
            .iter()
            .filter(|path| !path.starts_with("settings."))
            .map(|path| percentile(path).unwrap_or(path.clone()))
            .collect();
        written.insert("settings".into());
        let page = include_str!("../../../docs/json.md");
        let part = page.split("\n# ").find(|part| part.starts_with("The file that `twobounce demo")).expect("a part");
        let cell = |line: &str| line.strip_prefix("| `").and_then(|rest| rest.split('`').next()).map(str::to_owned);
        assert_eq!(written, part.lines().filter_map(cell).collect());
        assert!(part.contains(&format!("`version` is {VERSION}")));
    }
}
