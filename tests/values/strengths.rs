//! The pages that `examples/strengths.rs` writes are those in the project: quoted tables word by word, and in
//! `docs/study/strengths.md` a line of measurements per preset.

#[path = "../../examples/strengths.rs"]
#[allow(dead_code)]
mod example;

use std::fs;
use std::path::Path;

use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

const AGAIN: &str = "run `cargo run --release --example strengths`";

#[test]
fn the_pages_are_what_the_example_writes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, text, filled) in example::tables::pages(root).expect("pages with tables") {
        assert!(text == filled, "the tables of {name} differ from the study's rows: {AGAIN}");
    }
    let folder = root.join("docs/study");
    let page = fs::read_to_string(folder.join("strengths.md")).expect("the page");
    let rest = page.strip_prefix(example::OPENING).unwrap_or_else(|| panic!("another opening: {AGAIN}"));
    let quoted = example::quoted(&folder).expect("the study's rows");
    let rest = rest.strip_prefix(&quoted).unwrap_or_else(|| panic!("the study's rows say something else: {AGAIN}"));
    assert!(!quoted.contains('–'), "a preset has no row on a scene: run the study");
    for preset in example::PRESETS {
        let line = rest.lines().find(|line| line.starts_with(&format!("| `{preset}` |"))).expect(AGAIN);
        let numbers: Vec<f64> =
            line.split('|').filter_map(|cell| cell.trim().strip_suffix(" %")?.parse().ok()).collect();
        assert_eq!(numbers.len(), 5, "{line}: {AGAIN}");
    }
}

/// The measure of leaks, where it is known: nothing blocks light in `lpv.occlusion = none`, and direct light alone does not leak.
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
