//! `docs/notes/strengths.md` has a line of measurements per preset, and the measurements are right where the value is
//! known.

#[path = "../../examples/pages/strengths.rs"]
#[allow(dead_code)]
mod example;

use std::path::Path;

use crate::tables;
use twobounce::lab::table;
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

const AGAIN: &str = "run `cargo run --release --example pages -- strengths`";

#[test]
fn every_preset_is_measured() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/notes/strengths.md");
    let page = std::fs::read_to_string(path).expect("the page");
    let tables = table::tables(&page).expect("marks");
    let (_, measured) = tables.iter().find(|(name, _)| name == "measured").expect(AGAIN);
    for preset in tables::CHOSEN {
        let line = measured.lines().find(|line| line.starts_with(&format!("| `{preset}` |"))).expect(AGAIN);
        let numbers: Vec<f64> =
            line.split('|').filter_map(|cell| cell.trim().strip_suffix(" %")?.parse().ok()).collect();
        assert_eq!(numbers.len(), 5, "{line}: {AGAIN}");
    }
}

/// The measure of leaks, where it is known: nothing blocks light with `lpv.occlusion = none`, and direct light alone
/// does not leak.
#[test]
fn leaks_are_found_and_walls_found_tight() {
    let context = Context::new(&ContextOptions { validation: true, ..Default::default() }).expect("a device");
    let leak = |changes: &[&str]| {
        let mut settings = Settings::lpv();
        changes.iter().for_each(|change| settings.set(change).expect("a setting"));
        example::leak(&context, &settings, 1.0).expect("two images")
    };
    assert_eq!(leak(&["voxels=32", "method=none"]), 0.0, "no direct light comes through a wall");
    assert!(leak(&["voxels=32", "lpv.occlusion=none"]) > 0.01, "what nothing blocks leaks");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}
