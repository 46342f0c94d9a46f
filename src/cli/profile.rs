//! `twobounce profile`: what a frame costs, per pass and per thing, and how it grows.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use serde::Serialize;
use twobounce::output::file;
use twobounce::profile::copy::{self, CopyRates};
use twobounce::profile::costs::{self, PassCost, Work};
use twobounce::profile::growth::{self, Growth};
use twobounce::profile::{Run, Subject, plot};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs, SettingsArgs, SubmitArg};
use super::report::{self, RenderReport, SceneReport};
use super::scene::Opened;
use super::{Outcome, interrupt, job, out};
use crate::say;

/// Version of the JSON form; it grows when a key changes its name, its unit or its meaning.
const VERSION: u32 = 1;
/// Frames of one run along an axis of growth, at most: many runs, and a line through them.
const GROWTH_FRAMES: u32 = 3;

#[derive(Args, Debug)]
pub struct ProfileArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Frames that times are taken over, after one to warm up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: u32,
    /// Also measure how each pass grows with the grid's edge (16 to 128), the triangles (×1 ×4 ×16) and the pixels: minutes
    /// on a CPU device
    #[arg(long)]
    pub growth: bool,
    /// Draw the growth
    #[arg(long, value_name = "FILE.svg", requires = "growth")]
    pub plot: Option<PathBuf>,
    /// Write everything as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// What is submitted to the device at once; `pass` also times each pass by the CPU's clock
    #[arg(long, value_enum, default_value_t = SubmitArg::Frame)]
    pub submit: SubmitArg,
    /// Refuse to take more device memory than this
    #[arg(long, value_name = "SIZE", value_parser = super::args::memory_size)]
    pub memory_limit: Option<u64>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// The file that `--json` writes.
#[derive(Serialize)]
struct ProfileReport<'a> {
    version: u32,
    /// As `render --json` writes it.
    render: RenderReport<'a>,
    copy: CopyRates,
    costs: &'a [PassCost],
    growth: &'a [Growth],
}

/// Profiles what the arguments ask for.
pub fn run(args: &ProfileArgs) -> anyhow::Result<Outcome> {
    let settings = args.settings.effective()?;
    args.scene.check()?;
    job::check_targets([&args.json, &args.plot].into_iter().flatten(), &args.scene, &args.settings)?;
    interrupt::install()?;
    let opened = args.scene.open()?;
    opened.notes.iter().for_each(|note| out::complain(&format!("note: {note}")));
    let Opened { scene, shot, width, height, camera, .. } = &opened;
    let size = (*width, *height);
    let context = args.device.open(size.0, size.1)?;
    say!("{}: triangles {}, camera {camera}, {width}x{height}", scene.name, scene.triangle_count());
    say!("{}: {}", context.name, context.driver);
    let (pose, bounds) = (shot.pose(scene, 0.0), shot.bounds(scene));
    let view = shot.view(scene, &pose);
    let subject = Subject {
        scene,
        pose: &pose,
        view: &view,
        settings: settings.clone(),
        size,
        submit: args.submit.into(),
        memory_limit: args.memory_limit,
        bounds,
        check: interrupt::check,
    };
    let budget_bytes = context.memory_budget();
    let frames = subject.run(&context, args.frames)?;
    out::write(&frames.timings.table());
    let counters = frames.reports.last().expect("at least one frame").counters;
    say!(
        "recorded triangles {}, list items {}, occupied voxels {}",
        counters.triangles,
        counters.list_items,
        counters.occupied_voxels
    );
    let copy = copy::measure(&context)?;
    let counting = args.device.open_counting(size.0, size.1)?;
    let counted = subject.count(&counting)?;
    refuse_invalid(&counting)?;
    let pixels = u64::from(size.0) * u64::from(size.1);
    let units = costs::units(settings.method);
    let work = Work { units: &units, frame: &counters, pixels, copy: &copy };
    let costs = costs::costs(&frames.timings.passes(), &counted, &work);
    out::write(&format!("\n{}", costs::table(&costs, &copy)));
    let growth =
        if args.growth { growth::measure(&context, &subject, args.frames.min(GROWTH_FRAMES))? } else { vec![] };
    growth.iter().for_each(|axis| out::write(&format!("\n{}", growth::table(axis))));
    refuse_invalid(&context)?;
    let size_words = format!("{width}×{height}");
    if let Some(path) = &args.plot {
        let title = format!("{}, {size_words}, {} voxels, {}", scene.name, settings.voxels, context.name);
        write(path, &plot::svg(&title, &growth))?;
    }
    if let Some(path) = &args.json {
        let scene = SceneReport {
            name: scene.name.clone(),
            hash: scene.hash.clone(),
            triangles: scene.triangle_count(),
            camera: camera.clone(),
            time_s: args.scene.time,
        };
        let render = render_report(&context, &frames, size, budget_bytes, scene, settings.method.name(), &settings);
        let report = ProfileReport { version: VERSION, render, copy, costs: &costs, growth: &growth };
        write(path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    Ok(Outcome::Done)
}

fn render_report<'a>(
    context: &Context,
    run: &Run,
    size: (u32, u32),
    budget_bytes: u64,
    scene: SceneReport,
    method: &'static str,
    settings: &'a twobounce::settings::Settings,
) -> RenderReport<'a> {
    let memory = report::memory(&run.plan, run.allocated_bytes, budget_bytes);
    let timings = run.timings.report(context, size, report::counters(&run.reports), Some(memory));
    RenderReport { scene, method, settings, exposure_ev: None, timings }
}

/// Numbers of a device that was used wrongly say nothing.
fn refuse_invalid(context: &Arc<Context>) -> Result<()> {
    match context.validation_messages().first() {
        Some(first) => Err(Error::Device(format!("the validation layer objects, so nothing is written: {first}"))),
        None => Ok(()),
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    file::write(path, text.as_bytes())?;
    say!("wrote {}", path.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use twobounce::profile::counts::Counts;
    use twobounce::profile::growth::PassGrowth;
    use twobounce::settings::Settings;

    /// A key that is renamed, added or dropped must be so in the page too, and its version looked at.
    #[test]
    fn the_keys_are_those_of_the_page() {
        let settings = Settings::default();
        let cost = PassCost {
            name: "shade 1",
            ns_per_occupied_voxel: Some(1.0),
            ns_per_list_item: Some(1.0),
            ns_per_pixel: Some(1.0),
            ns_per_cone_step: Some(1.0),
            counts: Counts::default(),
            fetched_bytes: 1,
            written_bytes: 1,
            gb_per_s: 1.0,
            share_of_copy: 1.0,
        };
        let pass = PassGrowth { name: "shade 1", gpu_ms: vec![1.0], exponent: Some(1.0) };
        let growth = Growth {
            axis: "voxels",
            values: vec![16.0],
            occupied_voxels: vec![1],
            passes: vec![pass],
            left_out: vec!["why".into()],
        };
        let report = ProfileReport {
            version: VERSION,
            render: report::tests::report(&settings),
            copy: CopyRates { buffer_gb_per_s: 1.0, shader_gb_per_s: 1.0 },
            costs: &[cost],
            growth: &[growth],
        };
        let mut written = BTreeSet::new();
        report::tests::paths(&serde_json::to_value(report).unwrap(), "", &mut written);
        // The first part of the page is that of `render`, which another test holds against the program.
        written.retain(|path| !path.starts_with("render."));
        written.insert("render".into());
        let page = include_str!("../../docs/json.md");
        let page =
            page.split("\n# ").find(|part| part.starts_with("The file that `twobounce profile")).expect("a part");
        let cell = |line: &str| line.strip_prefix("| `").and_then(|rest| rest.split('`').next()).map(str::to_owned);
        assert_eq!(written, page.lines().filter_map(cell).collect());
        assert!(page.contains("`twobounce profile --json") && page.contains(&format!("`version` is {VERSION}")));
    }
}
