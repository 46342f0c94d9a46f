//! The whole pipeline against closed forms: furnaces, ambient occlusion.

use crate::gpu;

use glam::{DAffine3, DVec3, Vec3};
use gpu::twins::closed_forms;
use twobounce::layers::Aov;
use twobounce::scene::{Material, Mesh, Projection, Scene, View, analytic};
use twobounce::settings::Settings;

/// Mean and largest pixel over Σρᵏ after two bounces.
fn furnace_ratio(albedo: f32, block: bool, settings: &Settings) -> (f64, f64) {
    let scene = analytic::furnace(albedo, 1.0, block);
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let image = gpu::render_from(&gpu::context(), &scene, settings, 32, view).read();
    let expected = closed_forms::furnace(f64::from(albedo), 2);
    let ratios: Vec<f64> = image.beauty().iter().map(|p| f64::from(p[1]) / expected).collect();
    (ratios.iter().sum::<f64>() / ratios.len() as f64, ratios.iter().copied().fold(0.0, f64::max))
}

#[test]
fn saturating_cones_and_rays_keep_a_furnaces_energy_and_makes_none() {
    for (albedo, block) in [(0.5, false), (0.5, true), (0.8, false), (0.8, true)] {
        let cones = gpu::with(Settings::cones(), &["cones.set=g8", "cones.step=1.5"]);
        // Cones lose a tenth between their start and their first sample, and in corners; rays lose two hundredths in
        // voxels that hold parts of two walls; f16 in two volumes and their mips takes a hundredth.
        for (settings, least) in [(cones, 0.9), (Settings::fast(), 0.98)] {
            // Lamps that are sampled are not in the volumes, and here every wall is a lamp.
            let settings = gpu::with(settings, &["voxels=32", "lights.lamps=gathered"]);
            let (mean, most) = furnace_ratio(albedo, block, &settings);
            let right = (least..=1.01).contains(&mean) && most < 1.01;
            assert!(right, "{:?}, albedo {albedo}, block {block}: {mean}, {most} at most", settings.method);
        }
    }
}

#[test]
fn no_fill_makes_energy() {
    for fill in ["cones.fill=uniform", "cones.fill=facing", "cones.fill=coverage"] {
        let (_, most) = furnace_ratio(0.8, true, &gpu::with(Settings::corrected(), &["voxels=16", fill]));
        // f16, as above.
        assert!(most < 1.01, "{fill}: {most}");
    }
}

/// A floor under an opaque square of half side `half`, one metre above it, or under nothing.
fn sheltered(half: Option<f32>) -> Scene {
    let mut scene = Scene::empty("sheltered floor");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    if let Some(half) = half {
        let corner = Vec3::new(-half, 1.0, -half);
        let ceiling = Mesh::quad("ceiling", grey, corner, Vec3::X * 2.0 * half, Vec3::Z * 2.0 * half);
        scene.add_mesh(ceiling, DAffine3::IDENTITY);
    }
    scene.sky = Vec3::ONE;
    scene
}

#[test]
fn ambient_occlusion_under_a_square_is_the_form_factors() {
    let at = |scene: &Scene| {
        let projection = Projection::Orthographic { half_height: 0.05, near: 0.01, far: 10.0 };
        let down = View { eye: DVec3::Y * 0.5, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
        let settings = gpu::with(Settings::cones(), &["voxels=64", "lights.lamps=gathered", "cones.set=g64"]);
        let image = gpu::render_layers(&gpu::context(), scene, &settings, 8, down, vec![Aov::Ao]).read();
        let open = image.get(Aov::Ao).expect("the layer asked for");
        open.iter().map(|p| f64::from(p[0])).sum::<f64>() / open.len() as f64
    };
    // The floor itself occludes nothing.
    let open = at(&sheltered(None));
    assert!((open - 1.0).abs() < 0.02, "open floor: {open}");
    for half in [0.5, 1.0, 1.9] {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let square = corners.map(|(x, z)| DVec3::new(x * half, 1.0, z * half));
        let expected = closed_forms::ambient_occlusion(DVec3::ZERO, DVec3::Y, &square);
        let open = at(&sheltered(Some(half as f32)));
        // Sixty-four cones blur the square's edge over a sixteenth of a radian and a voxel's width.
        assert!((open - expected).abs() < 0.05, "half side {half}: {open} is not {expected}");
    }
}
