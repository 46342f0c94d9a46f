//! The whole pipeline against closed forms: furnaces, ambient occlusion.

#[path = "common/gpu.rs"]
mod gpu;
use twobounce::layers::Aov;
use twobounce::scene::analytic;
use twobounce::settings::{Fill, Settings};
use twobounce::twins::closed_forms;

/// Mean and largest pixel over Σρᵏ after two bounces.
fn furnace_ratio(albedo: f32, block: bool, settings: &Settings) -> (f64, f64) {
    let context = gpu::context();
    let scene = analytic::furnace(albedo, 1.0, block);
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let image = gpu::render_from(&context, &scene, settings, 32, view).read();
    let pixels = image.get(Aov::Beauty).expect("an image");
    let expected = closed_forms::furnace(f64::from(albedo), 2);
    let ratios: Vec<f64> = pixels.iter().map(|p| f64::from(p[1]) / expected).collect();
    (ratios.iter().sum::<f64>() / ratios.len() as f64, ratios.iter().fold(0.0, |a, b| f64::max(a, *b)))
}

#[test]
fn a_furnace_keeps_its_energy_and_makes_none() {
    for (albedo, block) in [(0.5, false), (0.5, true), (0.8, false), (0.8, true)] {
        for base in [
            Settings::fast(),
            Settings::balanced(),
            Settings::accurate(),
            Settings { fill: Fill::Coverage, ..Settings::default() },
            Settings { fill: Fill::Facing, ..Settings::default() },
        ] {
            let settings = Settings { voxels: 32, ..base };
            eprintln!("{albedo} {block} {} {:?}", settings.fill, furnace_ratio(albedo, block, &settings));
        }
        let settings = Settings { voxels: 32, fill: Fill::Uniform, ..Settings::default() };
        eprintln!("{albedo} {block} uniform {:?}", furnace_ratio(albedo, block, &settings));
        let (mean, most) = furnace_ratio(albedo, block, &settings);
        // Ten percent is what cones of a few voxels' reach may lose; one is f16 in two volumes' mips.
        assert!((0.9..=1.01).contains(&mean) && most < 1.01, "albedo {albedo}, block {block}: {mean}, {most} at most");
    }
}
