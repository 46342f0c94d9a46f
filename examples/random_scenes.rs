//! Random scenes against the path tracer: what a preset's image has of the truth's light, in standard deviations of both. Each scene
//! is shot at several places in the grid; their spread is the preset's deviation, the reference's own is added to it. What is not
//! finite ends the run. `docs/stability.md` says what was found.
//!
//! `cargo run --release --example random_scenes -- [--preset balanced] [--grid 32] [FIRST-LAST]` prints CSV, a line per scene.

use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use twobounce::chart::measure::same_depth;
use twobounce::measure::refuse_invalid;
use twobounce::reference::cache::Cache;
use twobounce::reference::film::Film;
use twobounce::reference::{self, Control, Options, Stop};
use twobounce::scene::{Alpha, Still};
use twobounce::stability::case::Place;
use twobounce::stability::cell::{Cell, Effort, settings};
use twobounce::stability::stage::{Stage, Studio};
use twobounce::stability::{SIZE, random};
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

const PLACES: usize = 4;
const SAMPLES: u32 = 64;

fn main() -> Result<()> {
    let (mut preset, mut grid, mut seeds) = ("balanced".to_owned(), 32, 0..1000);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let wrong = || Error::Usage(format!("{word}: give --preset NAME, --grid N or FIRST-LAST"));
        match word.as_str() {
            "--preset" => preset = words.next().ok_or_else(wrong)?,
            "--grid" => grid = words.next().and_then(|n| n.parse().ok()).ok_or_else(wrong)?,
            range => {
                let (first, last) = range.split_once('-').ok_or_else(wrong)?;
                let number = |n: &str| n.parse::<u64>().map_err(|_| wrong());
                seeds = number(first)?..number(last)? + 1;
            }
        }
    }
    let context = Context::new(&ContextOptions::default())?;
    let (cancel, cache) = (AtomicBool::new(false), Cache::of_user());
    println!("seed,ratio,deviations,share,reference's share,passes light");
    for seed in seeds {
        let effort = Effort { samples: SAMPLES, ..Effort::FULL };
        let mut cell = Cell {
            context: &context,
            cache: &cache,
            settings: settings(&preset, grid)?,
            effort,
            memory_limit: None,
            cancel: &cancel,
            frame_ms: Rc::default(),
        };
        let stage = random::stage(seed);
        let passes = passes_light(&stage);
        let truth = truth(&stage, &cell)?;
        cell.settings = stage.with_its_grid(&cell.settings);
        let mut studio = Studio::new(&cell, stage)?;
        let shoot = |place| {
            let image = studio.shoot(place)?;
            refuse_invalid(&context)?;
            Ok(random::level(image.beauty(), truth.2))
        };
        let places = Place::all(PLACES + 1, false);
        let shots = places[1..].iter().map(shoot).collect::<Result<Vec<f64>>>()?;
        let ours = shots.iter().sum::<f64>() / PLACES as f64;
        let variance = shots.iter().map(|shot| (shot - ours).powi(2)).sum::<f64>() / (PLACES - 1) as f64;
        // Of one shot: what a user renders is one, not the mean.
        let deviation = (variance + truth.1.powi(2)).sqrt();
        let (ratio, far) = (ours / truth.0, (ours - truth.0).abs() / deviation.max(1e-9));
        println!("{seed},{ratio:.4},{far:.2},{:.5},{:.5},{}", deviation / truth.0, truth.1 / truth.0, u8::from(passes));
    }
    Ok(())
}

fn passes_light(stage: &Stage) -> bool {
    stage.scene.materials.iter().any(|m| m.transmission > 0.0 || m.alpha != Alpha::Opaque)
}

/// Level of the image, its standard error, and what counts of a value at most.
fn truth(stage: &Stage, cell: &Cell) -> Result<(f64, f64, f32)> {
    let stop = Stop::Samples(cell.effort.samples);
    let depth = same_depth(&stage.scene, &cell.settings);
    let options = Options { width: SIZE, height: SIZE, depth, stop, seed: 0, occlusion: false };
    let mut film = Film::new(SIZE, SIZE);
    let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: cell.cancel };
    reference::render(Still::new(&stage.scene, &stage.pose(), &stage.view), &options, &mut film, control)?;
    let layers = film.layers(&[]);
    let bound = random::bound(layers.beauty());
    let error = |e: &[f32; 3]| e.iter().map(|v| f64::from(v.clamp(-bound, bound))).sum::<f64>() / 3.0;
    let squares: f64 = film.error().iter().map(|e| error(e).powi(2)).sum();
    Ok((random::level(layers.beauty(), bound), squares.sqrt() / f64::from(SIZE * SIZE), bound))
}
