//! Passes 1 and 2a against an oracle of another kind: the listed pairs equal those of clipping in f64.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::path::Path;

use glam::{DAffine3, DVec3, Vec3};
use gpu::twins::record::{in_voxels, record};
use gpu::twins::voxelise::{Comparison, compare_sets, voxelise, voxelise_dilated};
use scenes::{Random, add, triangle};
use twobounce::ground::layout::Triangle;
use twobounce::scene::{LoadOptions, Material, Mesh, Scene};
use twobounce::settings::{Bounces, Settings};
use twobounce::vk::download;

/// The talk's shading by cells, one bounce.
fn cells(edge: u32) -> Settings {
    let settings = Settings { voxels: edge, bounces: Bounces::One, ..Settings::corrected() };
    gpu::with(settings, &["cones.passes=cells"])
}

/// A grid of 1 m voxels from the origin on.
fn metre_grid(edge: u32) -> Settings {
    let mut settings = cells(edge);
    settings.grid.center = Some([f64::from(edge) / 2.0; 3]);
    settings.grid.side = Some(f64::from(edge));
    settings
}

/// The scene's triangles, as f32 hands them to the device.
fn compare(scene: &Scene, settings: &Settings) -> Comparison {
    let context = gpu::context();
    let renderer = gpu::render(&context, scene, settings, 16);
    let grid = &renderer.ground().grid;
    let recorded = record(scene, &scene.pose(None, 0.0));
    let triangles = in_voxels(&recorded, grid.corner, grid.voxel_m);
    compare_sets(&gpu::listed_pairs(&context, &renderer), &voxelise(&triangles, settings.voxels))
}

fn of_triangles(triangles: &[[DVec3; 3]]) -> Scene {
    let mut scene = Scene::empty("triangles");
    add(&mut scene, triangles, Material { double_sided: true, ..Material::lamp("lamp", Vec3::ONE) });
    scene
}

fn is_exact(scene: &Scene, settings: &Settings) -> Comparison {
    let found = compare(scene, settings);
    assert_eq!((found.recall, found.precision), (1.0, 1.0), "{}: {found:?}", scene.name);
    found
}

#[test]
fn a_hundred_thousand_slivers_are_listed_exactly() {
    // Up to 32 voxels long and at most 0.02 wide: a normal from a plain cross product is off by more than a voxel's slack.
    let (mut random, limit) = (Random::new(1), DVec3::splat(64.0));
    let mut sliver = || {
        let a = random.point() * 64.0;
        let b = a + (random.point() - 0.5) * 32.0;
        [a, b, b + (random.point() - 0.5) * 0.02].map(|p| p.clamp(DVec3::ZERO, limit).as_vec3().as_dvec3())
    };
    let slivers: Vec<_> = (0..100_000).map(|_| sliver()).collect();
    let found = is_exact(&of_triangles(&slivers), &metre_grid(64));
    assert!(found.touching < 0.01, "{found:?}");
}

/// A third are needles, a third are smaller than a voxel of any grid up to 256, a third are of any shape.
#[test]
fn needles_and_tiny_triangles_are_listed_exactly() {
    let mut random = Random::new(3);
    let mut triangle = |i: usize| {
        let a = random.point();
        let (b, c) = match i % 3 {
            0 => (random.point(), 1e-4 * (random.point() - 0.5)),
            1 => (a + 2e-3 * (random.point() - 0.5), 2e-3 * (random.point() - 0.5)),
            _ => (random.point(), random.point() - 0.5),
        };
        [a, b, b + c].map(|p| (64.0 * p.clamp(DVec3::ZERO, DVec3::ONE)).as_vec3().as_dvec3())
    };
    let triangles: Vec<_> = (0..3000).map(&mut triangle).collect();
    let found = is_exact(&of_triangles(&triangles), &metre_grid(64));
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
        let t = triangle(&mut random, DVec3::ZERO, size);
        let inside = |p: DVec3| p.clamp(DVec3::splat(0.3), DVec3::splat(31.7)).as_vec3().as_dvec3();
        triangles.push(t.map(|p| inside(center + p * squash)));
    }
    let found = is_exact(&of_triangles(&triangles), &metre_grid(32));
    assert!(found.touching < 0.01, "{found:?}");
}

/// D30: the talk tests the dilated triangle.
#[test]
fn dilated_triangles_are_listed_where_their_twin_lists_them() {
    let mut random = Random::new(4);
    // Nearly equilateral, three voxels large, in every plane.
    let mut triangle = || {
        let (center, x) = (random.point() * 8.0 + 4.0, random.direction());
        let y = x.cross(random.direction()).normalize();
        [0.0, 2.0, 4.0].map(|k: f64| {
            let (sin, cos) = (k * PI / 3.0 + 0.3 * random.unit()).sin_cos();
            (center + 1.7 * (cos * x + sin * y)).as_vec3().as_dvec3()
        })
    };
    let triangles: Vec<_> = (0..200).map(|_| triangle()).collect();
    let (context, scene) = (gpu::context(), of_triangles(&triangles));
    let renderer = gpu::render(&context, &scene, &gpu::with(metre_grid(16), &["cones.ledger.d30=printed"]), 16);
    let found = gpu::listed_pairs(&context, &renderer);
    let compared = compare_sets(&found, &voxelise_dilated(&triangles, 16));
    assert_eq!((compared.recall, compared.precision), (1.0, 1.0), "{compared:?}");
    assert!(compared.touching < 0.1, "{compared:?}");
    // The triangles themselves are listed as before, and so is a third as much again.
    let exact = voxelise(&triangles, 16);
    assert_eq!(compare_sets(&found, &exact).recall, 1.0);
    assert!(found.len() > 4 * exact.certain.len() / 3, "{} of {}", found.len(), exact.certain.len());
}

/// The ledger's row says how much longer the lists of a scene are that has triangles smaller than a voxel.
#[test]
fn the_gallerys_dilated_lists_are_twice_as_long() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/gallery.glb");
    let (context, scene) = (gpu::context(), Scene::load(&path, &LoadOptions::default()).expect("the gallery"));
    let listed = |form| gpu::listed_pairs(&context, &gpu::render(&context, &scene, &gpu::with(cells(32), &[form]), 16));
    let [exact, dilated] = ["cones.ledger.d30=right", "cones.ledger.d30=printed"].map(listed);
    let held: BTreeSet<_> = dilated.iter().collect();
    assert!(exact.iter().all(|pair| held.contains(pair)));
    let ratio = dilated.len() as f64 / exact.len() as f64;
    assert!((2.2..2.25).contains(&ratio), "{ratio}");
}

#[test]
fn rooms_are_listed_exactly() {
    for name in ["cornell-point", "cornell-area", "gallery"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/{name}.glb"));
        let scene = Scene::load(&path, &LoadOptions::default()).expect(name);
        is_exact(&scene, &cells(64));
    }
}

#[test]
fn walls_in_voxel_faces_touch_both_sides_and_break_nothing() {
    // Made to touch: either answer is right, and whatever is certain must be there.
    let mut scene = Scene::empty("box on voxel faces");
    let material = scene.add_material(Material::default());
    let cuboid = Mesh::cuboid("box", material, Vec3::splat(4.0), Vec3::splat(12.0), false);
    scene.add_mesh(cuboid, DAffine3::IDENTITY);
    assert!(is_exact(&scene, &metre_grid(16)).touching > 0.5);
}

#[test]
fn a_mirrored_instance_keeps_its_front() {
    let mut scene = Scene::empty("a box and its mirror image");
    let material = scene.add_material(Material::default());
    let mesh = Mesh::cuboid("box", material, Vec3::ONE, Vec3::new(2.0, 3.0, 4.0), false);
    scene.add_mesh(mesh.clone(), DAffine3::IDENTITY);
    scene.add_mesh(mesh, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
    let context = gpu::context();
    let renderer = gpu::render(&context, &scene, &cells(16), 16);
    let triangles: Vec<Triangle> = download(&context, &renderer.ground().triangles).expect("triangles");
    assert_eq!(triangles.len(), 24);
    for t in triangles {
        let [a, b, c] = t.vertices.map(|v| Vec3::from(v.position));
        let facing = (b - a).cross(c - a).normalize().dot(Vec3::from(t.vertices[0].normal));
        assert!((facing - 1.0).abs() < 1e-4, "triangle {}: its winding and its normal are {facing}", t.source);
    }
}
