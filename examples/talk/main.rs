//! Writes `docs/talk.md`, the talk's slides one by one, with its pictures and the times of its stages.
//!
//! `cargo run --release --example talk`; `-- --keep-times` leaves the table of times as it is on the page.

mod page;
mod pictures;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use glam::Vec3;
use twobounce::measure::timing::Timings;
use twobounce::output::file;
use twobounce::reference::film::Film;
use twobounce::reference::{self, Control, Depth, Options, Stop};
use twobounce::renderer::{Context, ContextOptions, RenderOptions, Renderer};
use twobounce::scene::Still;
use twobounce::{Error, Result};

/// Samples per pixel of the path-traced image.
const SAMPLES: u32 = 96;
/// Frames that are timed, after one that compiles.
const FRAMES: usize = 3;

fn main() -> Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let (mut all, ev) = pictures::rendered(pictures::IMAGE_SIZE)?;
    all.push(traced(ev)?);
    for (name, bytes) in all {
        file::write(&docs.join("talk").join(name), &bytes)?;
        println!("docs/talk/{name}: {} bytes", bytes.len());
    }
    let path = docs.join("talk.md");
    let before = std::fs::read_to_string(&path).map_err(|e| Error::file(&path, format!("cannot be read: {e}")))?;
    let kept = page::times_of(&before).filter(|_| std::env::args().any(|arg| arg == "--keep-times"));
    let times = kept.map_or_else(times, |times| Ok(times.to_owned()))?;
    file::write(&path, page::document(&times).as_bytes())
}

/// The path-traced picture at an exposure of `ev`.
fn traced(ev: f32) -> Result<pictures::Named> {
    let scene = pictures::gallery()?;
    let pose = scene.pose(None, 0.0);
    let stop = Stop::Samples(SAMPLES);
    let (width, height) = (pictures::IMAGE_SIZE, pictures::IMAGE_SIZE);
    let options = Options { width, height, depth: Depth::Bounces(2), stop, seed: 0, occlusion: false };
    let mut film = Film::new(width, height);
    let control = Control { progress: &|_| (), save: &mut |_| Ok(()), cancel: &AtomicBool::new(false) };
    reference::render(Still::new(&scene, &pose, &scene.view(&pose, 0)), &options, &mut film, control)?;
    let layers = film.layers(&[]);
    let pixel = |x: u32, y: u32| pictures::exposed(Vec3::from(layers.beauty()[(y * width + x) as usize]), ev);
    Ok(("path-traced.png", pictures::sheet(&[pictures::square(width, pixel)], 1)))
}

/// A table of the milliseconds that each pass takes with each of the talk's presets.
fn times() -> Result<String> {
    let scene = pictures::gallery()?;
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let view = scene.view(&pose, 0);
    let context = Context::new(&ContextOptions::default())?;
    let mut rows: Vec<(&str, Vec<(usize, f64)>)> = Vec::new();
    for (column, (_, settings)) in pictures::presets().into_iter().enumerate() {
        let options = RenderOptions::new((pictures::IMAGE_SIZE, pictures::IMAGE_SIZE), bounds);
        let mut renderer = Renderer::new(&context, scene.clone(), &pose, settings, options)?;
        let mut timings = Timings::new(1);
        for _ in 0..=FRAMES {
            renderer.make_anew();
            timings.push(renderer.render(&pose, &view)?);
        }
        for pass in timings.passes() {
            let cell = (column, pass.gpu_ms.median);
            match rows.iter_mut().find(|row| row.0 == pass.name) {
                Some(row) => row.1.push(cell),
                None => rows.push((pass.name, vec![cell])),
            }
        }
    }
    Ok(page::times(
        &format!("{} ({})", context.name, context.driver),
        &pictures::presets().map(|preset| preset.0),
        &rows,
    ))
}
