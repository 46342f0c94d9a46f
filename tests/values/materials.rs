//! The renderer's clearcoat, sheen and further extensions against the path tracer, and `docs/materials.md` as
//! `examples/pages` writes it.

#[path = "../../examples/pages/materials.rs"]
#[allow(dead_code)]
mod example;

use std::fs;
use std::path::Path;

use twobounce::ground::finish::approximated;
use twobounce::vk::{Context, ContextOptions};

const AGAIN: &str = "run `cargo run --release --example pages -- materials`";

#[test]
fn the_page_has_a_row_for_every_scene() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/materials.md");
    let page = fs::read_to_string(page).expect("the page");
    let (_, table) = page.split_once(example::HEADING).expect(AGAIN);
    for scene in example::scenes() {
        let row = table.lines().find(|line| line.starts_with(&format!("| {} |", scene.name))).expect(AGAIN);
        let numbers: Vec<f64> = row.split('|').filter_map(|cell| cell.trim().parse().ok()).collect();
        assert_eq!(numbers.len(), 4, "{row}: {AGAIN}");
        for note in approximated(&scene) {
            assert!(note.starts_with("material ") && note.contains(", approximated: "), "{note}");
        }
    }
}

/// Each scene's materials keep their brightness, and the validation layers find nothing. The images are smaller than
/// those of the page's numbers.
#[test]
fn materials_look_as_the_reference_has_them() {
    let context = Context::new(&ContextOptions { validation: true, ..Default::default() }).expect("a device");
    // The renderer disperses nothing, and glass has tests of its own.
    let plain = |name: &str| ["none", "glass", "dispersion"].iter().any(|start| name.starts_with(start));
    for scene in example::scenes().into_iter().filter(|scene| !plain(&scene.name)) {
        let image = example::rendered(&context, &scene, 48).expect("an image");
        let truth = example::traced(&scene, 48, 64).expect("a reference");
        let row = example::row(&scene.name, &image, &truth).expect("numbers");
        let numbers: Vec<f64> = row.split('|').filter_map(|cell| cell.trim().parse().ok()).collect();
        let [_, _, rel, energy] = numbers[..] else { panic!("{row}") };
        // The method's own error, the reference's noise on bright spots, and the approximations in docs/materials.md.
        assert!(rel < 0.35 && (energy - 1.0).abs() < 0.13, "{row}");
    }
    assert!(context.validation_messages().is_empty(), "{:?}", context.validation_messages());
}
