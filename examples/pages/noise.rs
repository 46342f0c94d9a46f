//! Tells whether the distances from ideals in `docs/notes/stability.md` are noise of few rays, which falls with more
//! rays, or bias.

use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use twobounce::Result;
use twobounce::chart::measure::same_depth;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::markdown;
use twobounce::measure::refuse_invalid;
use twobounce::measure::timing::Spread;
use twobounce::reference::Stop;
use twobounce::reference::cache::Cache;
use twobounce::scene::Alpha;
use twobounce::settings::Settings;
use twobounce::stability::case::{Case, Place};
use twobounce::stability::cell::{Cell, Effort, settings};
use twobounce::stability::row::Measured;
use twobounce::stability::stage::{CaseRenderer, Stage};
use twobounce::stability::{SIZE, cases, random};
use twobounce::vk::{Context, ContextOptions};

/// Prints a row per case, and a column per set of changes.
#[derive(Args)]
pub struct Noise {
    #[arg(long, default_value = "balanced")]
    preset: String,
    #[arg(long, default_value_t = 32)]
    grid: u32,
    #[arg(long = "case", value_name = "NAME,…", value_delimiter = ',', required = true, value_parser = case)]
    cases: Vec<&'static Case>,
    /// Changes of settings
    #[arg(value_name = "KEY=VALUE[,KEY=VALUE…]")]
    changes: Vec<String>,
}

fn case(name: &str) -> std::result::Result<&'static Case, &'static str> {
    cases::named(name).ok_or("there is no such case")
}

/// Measures a cell with these settings.
fn with_cell<T>(settings: Settings, effort: Effort, run: impl FnOnce(&Cell) -> Result<T>) -> Result<T> {
    let (context, cancel) = (Context::new(&ContextOptions::default())?, AtomicBool::new(false));
    let (context, cache, cancel) = (&context, &Cache::of_user(), &cancel);
    run(&Cell { context, cache, settings, effort, memory_limit: None, cancel, frame_ms: Rc::default() })
}

impl Noise {
    pub fn run(&self) -> Result<()> {
        // Places at three angles; four symmetries.
        let effort = Effort { places: 3, ..Effort::FULL };
        let rows = with_cell(settings(&self.preset, self.grid)?, effort, |cell| {
            let number = |case: &Case, changes: &String| {
                let changed = changes.split(',').filter(|change| !change.is_empty());
                let cell = changed.clone().try_fold(cell.clone(), |cell, change| cell.with(change))?;
                let (measured, _) = Measured::of_samples(case, &case.run(&cell)?, &[], 0.0);
                let Spread { min, median, max } = measured.number;
                Ok(case.numbers_in_words(median, min, max))
            };
            let row = |case: &&Case| {
                let numbers = self.changes.iter().map(|changes| number(case, changes));
                std::iter::once(Ok(case.name.clone())).chain(numbers).collect::<Result<Vec<_>>>()
            };
            self.cases.iter().map(row).collect::<Result<Vec<_>>>()
        })?;
        let head = std::iter::once("case").chain(self.changes.iter().map(String::as_str));
        print!("{}", markdown(head, "-:", rows));
        Ok(())
    }
}

/// Prints CSV about random scenes, a line per scene: the share of the reference's light in a preset's image, in
/// standard deviations of both. Each scene is rendered at several places in the grid; their spread is the preset's
/// deviation, to which the reference's own is added. A value that is not finite ends the run.
#[derive(Args)]
pub struct RandomScenes {
    #[arg(long, default_value = "balanced")]
    preset: String,
    #[arg(long, default_value_t = 32)]
    grid: u32,
    #[arg(default_value_t = 0)]
    first: u64,
    #[arg(default_value_t = 999)]
    last: u64,
}

const PLACES: usize = 4;
const SAMPLES: u32 = 64;

impl RandomScenes {
    pub fn run(&self) -> Result<()> {
        println!("seed,ratio,deviations,share,reference's share,passes light");
        with_cell(settings(&self.preset, self.grid)?, Effort::FULL, |cell| {
            (self.first..=self.last).try_for_each(|seed| measure(cell, seed))
        })
    }
}

fn measure(cell: &Cell, seed: u64) -> Result<()> {
    let stage = random::stage(seed);
    let passes = stage.scene.materials.iter().any(|m| m.transmission > 0.0 || m.alpha != Alpha::Opaque);
    let (level, error, bound) = truth(&stage, cell)?;
    let mut studio = CaseRenderer::new(&Cell { settings: stage.with_its_grid(&cell.settings), ..cell.clone() }, stage)?;
    let shoot = |place| {
        let image = studio.shoot(place)?;
        refuse_invalid(cell.context)?;
        Ok(random::level(image.beauty(), bound))
    };
    let shots = Place::all(PLACES + 1, false)[1..].iter().map(shoot).collect::<Result<Vec<f64>>>()?;
    let ours = shots.iter().sum::<f64>() / PLACES as f64;
    let variance = shots.iter().map(|shot| (shot - ours).powi(2)).sum::<f64>() / (PLACES - 1) as f64;
    // The deviation of one image, because a user renders one and not the mean.
    let deviation = (variance + error.powi(2)).sqrt();
    let (ratio, far) = (ours / level, (ours - level).abs() / deviation.max(1e-9));
    println!("{seed},{ratio:.4},{far:.2},{:.5},{:.5},{}", deviation / level, error / level, u8::from(passes));
    Ok(())
}

/// Level of the image, its standard error, and the bound at which values are clamped.
fn truth(stage: &Stage, cell: &Cell) -> Result<(f64, f64, f32)> {
    let depth = same_depth(&stage.scene, &cell.settings);
    let specimen = Specimen { view: stage.view, ..Specimen::new(stage.scene.clone()) };
    let film = specimen.traced((SIZE, SIZE), depth, Stop::Samples(SAMPLES))?;
    let layers = film.layers(&[]);
    let bound = random::bound(layers.beauty());
    let error = |e: &[f32; 3]| e.iter().map(|v| f64::from(v.clamp(-bound, bound))).sum::<f64>() / 3.0;
    let squares: f64 = film.error().iter().map(|e| error(e).powi(2)).sum();
    Ok((random::level(layers.beauty(), bound), squares.sqrt() / f64::from(SIZE * SIZE), bound))
}
