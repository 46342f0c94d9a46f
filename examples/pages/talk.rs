//! Renders the pictures of `docs/notes/talk.md`, the talk's slides one by one, and fills its table of times.

use std::path::Path;

use glam::Vec3;
use twobounce::Result;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table;
use twobounce::measure::timing::Count;
use twobounce::output::file;
use twobounce::reference::{Depth, Stop};
use twobounce::vk::{Context, ContextOptions};

use crate::pictures;

/// Samples per pixel of the path-traced image.
const SAMPLES: u32 = 96;
/// Timed frames, after one that compiles.
const FRAMES: usize = 3;

/// `keep_times` leaves the page's table of times unchanged.
pub fn run(keep_times: bool) -> Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/notes");
    let (mut all, ev) = pictures::rendered(pictures::IMAGE_SIZE)?;
    all.push(traced(ev)?);
    for (name, bytes) in all {
        file::write(&docs.join("talk").join(name), &bytes)?;
        println!("docs/notes/talk/{name}: {} bytes", bytes.len());
    }
    if !keep_times {
        let times = times()?;
        table::fill_file(&docs.join("talk.md"), |_, _| Ok(times.clone()))?;
    }
    Ok(())
}

/// The path-traced picture at an exposure of `ev`.
fn traced(ev: f32) -> Result<pictures::Named> {
    let width = pictures::IMAGE_SIZE;
    let film = Specimen::new(pictures::gallery()?).traced((width, width), Depth::Bounces(2), Stop::Samples(SAMPLES))?;
    let layers = film.layers(&[]);
    let pixel = |x: u32, y: u32| pictures::exposed(Vec3::from(layers.beauty()[(y * width + x) as usize]), ev);
    Ok(("path-traced.png", pictures::sheet(&[pictures::square(width, pixel)], 1)))
}

/// A table of the milliseconds of each pass with each of the talk's presets.
fn times() -> Result<String> {
    let specimen = Specimen::new(pictures::gallery()?);
    let context = Context::new(&ContextOptions::default())?;
    let presets = pictures::presets();
    let mut rows: Vec<(&str, [Option<f64>; 3])> = Vec::new();
    for (column, (_, settings)) in presets.iter().enumerate() {
        let options = specimen.options((pictures::IMAGE_SIZE, pictures::IMAGE_SIZE));
        let mut renderer = specimen.renderer(&context, settings, options)?;
        let count = Count { warm_up: 1, least: FRAMES, most: FRAMES, enough_ms: 0.0 };
        let timings = count.frames(&mut renderer, &specimen.pose, &specimen.view, &|| Ok(()))?;
        for pass in timings.passes() {
            let row = rows.iter().position(|row| row.0 == pass.name).unwrap_or(rows.len());
            if row == rows.len() {
                rows.push((pass.name, [None; 3]));
            }
            rows[row].1[column] = Some(pass.gpu_ms.median);
        }
    }
    let sums = [0, 1, 2].map(|column| format!("{:.0}", rows.iter().filter_map(|row| row.1[column]).sum::<f64>()));
    let cell = |ms: Option<f64>| ms.map_or(table::MISSING.to_owned(), |ms| format!("{ms:.1}"));
    let lines = rows.iter().map(|(name, ms)| (*name, ms.map(cell))).chain([("all", sums)]);
    let lines = lines.map(|(name, cells)| std::iter::once(name.to_owned()).chain(cells));
    let head = std::iter::once("pass").chain(presets.iter().map(|preset| preset.0));
    Ok(format!(
        "Milliseconds of device time on {} ({}): the gallery at 512×512 pixels and 128³ voxels, every frame from scratch, median of \
         three.\n\n{}",
        context.name,
        context.driver,
        table::markdown(head, "-:", lines)
    ))
}
