//! Stability cases with changed settings: whether what is beyond a limit is noise, which falls with more passes, or stays.
//! `docs/noise.md` is what it prints.
//!
//! `cargo run --release --example stability_with -- [--preset NAME] [--grid N] [--case NAME,…] [KEY=VALUE[,KEY=VALUE…] …]` prints a
//! row per case, and a column per set of changes.

use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use twobounce::measure::timing::Spread;
use twobounce::reference::cache::Cache;
use twobounce::stability::case::Case;
use twobounce::stability::cases;
use twobounce::stability::cell::{Cell, Effort, settings};
use twobounce::stability::row::Measured;
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

/// Places at three angles; four symmetries.
const EFFORT: Effort = Effort { places: 3, ..Effort::FULL };

fn main() -> Result<()> {
    let (mut preset, mut grid, mut names, mut changes) = ("balanced".to_owned(), 32, String::new(), Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let wrong = || Error::Usage(format!("{word}: give --preset NAME, --grid N, --case NAME,… or KEY=VALUE,…"));
        match word.as_str() {
            "--preset" => preset = words.next().ok_or_else(wrong)?,
            "--grid" => grid = words.next().and_then(|n| n.parse().ok()).ok_or_else(wrong)?,
            "--case" => names = words.next().ok_or_else(wrong)?,
            change if change.contains('=') => changes.push(change.to_owned()),
            _ => return Err(wrong()),
        }
    }
    let context = Context::new(&ContextOptions::default())?;
    let (cancel, cache) = (AtomicBool::new(false), Cache::of_user());
    let number = |case: &Case, change: &str| {
        let mut settings = settings(&preset, grid)?;
        change.split(',').filter(|assignment| !assignment.is_empty()).try_for_each(|a| settings.set(a))?;
        let (context, cache, cancel) = (&context, &cache, &cancel);
        let cell =
            Cell { context, cache, settings, effort: EFFORT, memory_limit: None, cancel, frame_ms: Rc::default() };
        let samples = case.run(&cell)?;
        let (measured, _) = Measured::of(case, &samples, &[], 0.0);
        let Spread { min, median, max, .. } = measured.number;
        Ok::<_, Error>(case.words(median, min, max))
    };
    println!("| case | {} |", changes.join(" | "));
    println!("|---|{}", "---:|".repeat(changes.len()));
    for name in names.split(',') {
        let case = cases::named(name).ok_or_else(|| Error::Usage(format!("{name}: no such case")))?;
        let numbers = changes.iter().map(|change| number(case, change)).collect::<Result<Vec<_>>>()?;
        println!("| {name} | {} |", numbers.join(" | "));
    }
    Ok(())
}
