//! Passes 1 and 2a against an oracle of another kind: the listed pairs equal those of clipping in f64.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use glam::DVec3;
use scenes::{Random, add, cuboid, emitter, empty, quad, slivers};
use twobounce::scene::Scene;
use twobounce::settings::{Lists, Settings};
use twobounce::twins::record::{in_voxels, record};
use twobounce::twins::voxelise::{Comparison, compare_sets, voxelise};

/// A grid of 1 m voxels from the origin on.
fn metre_grid(edge: u32) -> Settings {
    let mut settings = Settings { voxels: edge, bounces: 1, lists: Lists::Reuse, ..Settings::default() };
    settings.volume.center = Some([f64::from(edge) / 2.0; 3]);
    settings.volume.side = Some(f64::from(edge));
    settings
}

/// The scene's triangles, as f32 hands them to the device.
fn compare(scene: &Scene, settings: &Settings) -> Comparison {
    let context = gpu::context();
    let renderer = gpu::render(&context, scene, settings, 16);
    let volume = renderer.volume();
    let recorded = record(scene, &scene.pose(None, 0.0));
    let triangles = in_voxels(&recorded, volume.corner, volume.voxel_m);
    compare_sets(&gpu::listed_pairs(&context, &renderer), &voxelise(&triangles, settings.voxels))
}

fn of_triangles(triangles: &[[DVec3; 3]]) -> Scene {
    let mut scene = empty();
    add(&mut scene, triangles, emitter(glam::Vec3::ONE, true));
    scene
}

#[test]
fn a_hundred_thousand_slivers_are_listed_exactly() {
    let found = compare(&of_triangles(&slivers(100_000, 64.0)), &metre_grid(64));
    assert_eq!((found.recall, found.precision), (1.0, 1.0), "{found:?}");
    assert!(found.touching < 0.01, "{found:?}");
}

#[test]
fn triangles_of_every_size_and_tilt_are_listed_exactly() {
    let mut random = Random::new(2);
    let mut triangles = Vec::new();
    for i in 0..6000 {
        // From a fiftieth of a voxel to the whole grid; every third lies nearly in an axis plane.
        let size = 0.02 * 1600f64.powf(random.unit());
        let center = random.point() * 32.0;
        let squash = if i % 3 == 0 { DVec3::new(1.0, 1e-3, 1.0) } else { DVec3::ONE };
        let mut corner = || (center + (random.point() - 0.5) * size * squash).clamp(DVec3::ZERO, DVec3::splat(32.0));
        triangles.push([corner(), corner(), corner()].map(|p| p.as_vec3().as_dvec3()));
    }
    let found = compare(&of_triangles(&triangles), &metre_grid(32));
    assert_eq!((found.recall, found.precision), (1.0, 1.0), "{found:?}");
    assert!(found.touching < 0.01, "{found:?}");
}

#[test]
fn edge_on_quads_and_walls_on_voxel_faces_are_listed_exactly() {
    let mut triangles = cuboid(DVec3::splat(4.0), DVec3::splat(12.0), false);
    for k in 0..3 {
        let (u, v) = (DVec3::AXES[(k + 1) % 3], DVec3::AXES[(k + 2) % 3]);
        triangles.extend(quad(DVec3::AXES[k] * 7.5 + u * 0.5 + v * 0.5, u * 15.0, v * 0.001));
    }
    let found = compare(&of_triangles(&triangles), &metre_grid(16));
    assert_eq!((found.recall, found.precision), (1.0, 1.0), "{found:?}");
}
