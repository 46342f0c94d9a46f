//! The whole pipeline against closed forms: furnaces, ambient occlusion.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use glam::{DVec3, Vec3};
use scenes::{add, cuboid, diffuse, empty};
use twobounce::layers::Aov;
use twobounce::scene::{Material, Scene, View};
use twobounce::settings::{Fill, Settings};
use twobounce::twins::closed_forms;

/// A closed room that emits 1 everywhere, empty or with a block in it, seen from within.
fn furnace(albedo: f32, block: bool) -> (Scene, View) {
    let glowing = || Material { emissive: Vec3::ONE, ..diffuse(albedo) };
    let mut scene = empty();
    add(&mut scene, &cuboid(DVec3::ZERO, DVec3::splat(2.0), true), glowing());
    if block {
        add(&mut scene, &cuboid(DVec3::new(0.9, 0.0, 0.5), DVec3::new(1.5, 0.8, 1.1), false), glowing());
    }
    (scene, View::look_at(DVec3::new(0.3, 1.4, 1.8), DVec3::new(1.2, 0.5, 0.6), DVec3::Y, 1.2))
}

/// Mean and largest pixel over Σρᵏ after two bounces.
fn furnace_ratio(albedo: f32, block: bool, settings: &Settings) -> (f64, f64) {
    let context = gpu::context();
    let (scene, view) = furnace(albedo, block);
    let image = gpu::render_from(&context, &scene, settings, 32, view).read();
    let pixels = image.get(Aov::Beauty).expect("an image");
    let expected = closed_forms::furnace(f64::from(albedo), 2);
    let ratios: Vec<f64> = pixels.iter().map(|p| f64::from(p[1]) / expected).collect();
    (ratios.iter().sum::<f64>() / ratios.len() as f64, ratios.iter().fold(0.0, |a, b| f64::max(a, *b)))
}

#[test]
fn a_furnace_keeps_its_energy_and_makes_none() {
    for (albedo, block) in [(0.5, false), (0.5, true), (0.8, false), (0.8, true)] {
        let settings = Settings { voxels: 32, fill: Fill::Uniform, ..Settings::default() };
        let (mean, most) = furnace_ratio(albedo, block, &settings);
        // Ten percent is what cones of a few voxels' reach may lose; one is f16 in two volumes' mips.
        assert!((0.9..=1.01).contains(&mean) && most < 1.01, "albedo {albedo}, block {block}: {mean}, {most} at most");
    }
}
