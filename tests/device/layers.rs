//! `examples/pages/layers.rs`: a layered draw and a dispatch over the whole grid fill volumes with equal bits; its page
//! is current.

use crate::gpu;

#[path = "../../examples/pages/layers.rs"]
#[allow(dead_code)]
mod example;
use crate::studio;

use twobounce::lab::specimen::Specimen;
use twobounce::settings::Settings;

#[test]
fn draws_and_dispatches_do_the_same_work() {
    let context = gpu::context();
    let settings = Settings { voxels: 16, ..Settings::printed() };
    let passes = example::measure(&context, Specimen::new(studio::room()), &settings, 1).expect("the same bits");
    assert_eq!(passes.len(), 3);
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}

#[test]
fn the_page_has_sections_of_drivers() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/notes/layers.md")).expect("the page");
    let (_, sections) = twobounce::lab::table::tables(&page).expect("marks").remove(0);
    assert!(sections.matches("## ").count() >= 2, "a section per driver");
}
