//! `twobounce profile`: the cost of a frame per pass and per voxel, pixel and cone step, and its growth.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use serde::Serialize;
use twobounce::measure::refuse_invalid;
use twobounce::output::file;
use twobounce::profile::copy::{self, CopyRates};
use twobounce::profile::costs::{self, PassCost, Work};
use twobounce::profile::growth::{self, Along, Growth, RunResult};
use twobounce::profile::{RepeatedFrame, executables, plot};
use twobounce::vk::{Context, Executable};
use twobounce::{Error, Result};

use super::args::{RunArgs, SceneArgs, SettingsArgs};
use super::lab::{Experiment, Pages, Runner};
use super::progress;
use super::report::{self, RenderReport};
use super::scene::{fitted, run_options};
use super::{interrupt, out, outputs};
use crate::say;

/// The version of the JSON form. It increases when a key changes its name, its unit or its meaning.
const VERSION: u32 = 1;
/// The maximum number of frames in a run along an axis of growth, because there are many runs and a fit through them.
const GROWTH_FRAMES: u32 = 3;

#[derive(Args, Debug)]
pub struct ProfileArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// The number of timed frames, after one warm-up frame
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// Also measure how each pass grows with the grid's edge (16 to 128), the triangles (×1 ×4 ×16) and the pixels,
    /// which takes minutes on a CPU device
    #[arg(long)]
    pub growth: bool,
    /// Plot the growth as an SVG
    #[arg(long, value_name = "FILE.svg", requires = "growth")]
    pub plot: Option<PathBuf>,
    /// Write everything as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// The file that `--json` writes.
#[derive(Serialize)]
struct ProfileReport {
    version: u32,
    /// The report of `render --json`.
    render: RenderReport,
    copy: CopyRates,
    costs: Vec<PassCost>,
    /// Programs of the driver; null if it does not describe them.
    executables: Option<Vec<Executable>>,
    growth: Vec<Growth>,
}

/// Profiles as the arguments request.
pub fn run(args: &ProfileArgs) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    args.scene.check()?;
    let inputs = [Some(&args.scene.path), args.settings.config.as_ref()];
    outputs::check(&inputs, &[args.json.as_ref(), args.plot.as_ref()])?;
    interrupt::install()?;
    let (opened, context) = args.scene.open_on_describing(&args.run)?;
    let settings = fitted(&opened, settings);
    let (scene, size, (pose, view)) = (&opened.scene, opened.size, &opened.still);
    let mut render = RenderReport::new(&opened, &settings, &context);
    let subject = RepeatedFrame {
        scene,
        pose,
        view,
        settings: settings.clone(),
        options: run_options(&opened, &args.run),
        check: interrupt::check,
    };
    let line = progress::Work::begin(&format!("{}: profile", scene.name));
    let frames = subject.run(&context, args.frames)?;
    render.add(&frames);
    let executables = context.executables()?;
    let timings = frames.timings;
    out::write(&timings.table());
    out::write(&report::counters_text(&timings));
    let copy = copy::measure(&context)?;
    let counting = args.run.device.open_counting(size)?;
    let counted = subject.count(&counting)?;
    refuse_invalid(&counting)?;
    let counters = timings.all().last().expect("at least one frame").counters;
    let pixels = u64::from(size.0) * u64::from(size.1);
    let work = Work { method: settings.method, frame: &counters, pixels, copy: &copy };
    let costs = costs::costs(&timings.passes(), &counted, &work);
    out::write(&format!("\n{}", costs::table(&costs, &copy)));
    out::write(&format!("\n{}", executables::table(executables.as_deref(), &context.name)));
    drop(line);
    let runs = if args.growth { growth::runs(&subject) } else { Vec::new() };
    let mut growing = Growing { subject, frames: args.frames.min(GROWTH_FRAMES), runs, found: Vec::new() };
    let runner = Runner { device: &args.run.device, size, budget: None };
    runner.run(&mut growing, context.clone(), &mut Pages::default())?;
    interrupt::check()?;
    let growth = if args.growth { growth::growth(&growing.runs, &growing.found) } else { Vec::new() };
    growth.iter().for_each(|axis| out::write(&format!("\n{}", growth::table(axis))));
    refuse_invalid(&context)?;
    if let Some(path) = &args.plot {
        let (voxels, device) = (settings.voxels, &context.name);
        let title = format!("{}, {}×{}, {voxels} voxels, {device}", scene.name, size.0, size.1);
        file::write(path, plot::svg(&title, &growth).as_bytes())?;
        say!("wrote {}", out::name(path));
    }
    if let Some(path) = &args.json {
        file::write_json(path, &ProfileReport { version: VERSION, render, copy, costs, executables, growth })?;
        say!("wrote {}", out::name(path));
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs along the axes of growth.
struct Growing<'a> {
    subject: RepeatedFrame<'a>,
    frames: u32,
    runs: Vec<Along>,
    /// Results in the order of the runs.
    found: Vec<RunResult>,
}

impl Experiment for Growing<'_> {
    fn len(&self) -> usize {
        self.runs.len()
    }

    fn is_measured(&self, row: usize) -> bool {
        row < self.found.len()
    }

    fn name(&self, row: usize) -> String {
        self.runs[row].what.clone()
    }

    fn measure(&mut self, row: usize, context: &Arc<Context>, _: &dyn Fn() -> Result<()>) -> Result<()> {
        self.found.push(Ok(self.runs[row].run(context, &self.subject, self.frames)?));
        Ok(())
    }

    fn keep_failure(&mut self, _: usize, error: Error) -> Result<()> {
        match error {
            Error::Memory(why) => self.found.push(Err(why)),
            other => return Err(other),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twobounce::profile::growth::PassGrowth;
    use twobounce::vk::{Statistic, StatisticValue};

    #[test]
    fn the_keys_are_those_of_the_page() {
        let growth = Growth {
            values: vec![16.0],
            occupied_voxels: vec![1],
            passes: vec![PassGrowth { gpu_ms: vec![1.0], ..PassGrowth::default() }],
            left_out: vec!["why".into()],
            ..Growth::default()
        };
        let statistic = Statistic { name: "n".into(), description: "d".into(), value: StatisticValue::Unsigned(1) };
        let report = ProfileReport {
            version: VERSION,
            render: report::tests::report(),
            copy: CopyRates::default(),
            costs: vec![PassCost::default()],
            executables: Some(vec![Executable { statistics: vec![statistic], ..Executable::default() }]),
            growth: vec![growth],
        };
        report::tests::assert_documented(&report, VERSION, "The file that `twobounce profile", &["render"]);
    }
}
