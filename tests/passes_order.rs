//! The same frame gives the same bits: over several runs, and with the triangles in another order.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use glam::{DVec3, Vec3};
use scenes::{Random, add, add_point_light, cuboid, diffuse, emitter, empty};
use twobounce::layers::Aov;
use twobounce::scene::{Material, Scene};
use twobounce::settings::{Fill, Settings, Weights};

/// A lit room full of triangles that share voxels, lamps of 10⁻⁶ and 10⁶ among them.
fn crowd(reversed: bool) -> Scene {
    let mut random = Random::new(4);
    let mut parts: Vec<(Vec<[DVec3; 3]>, Material)> =
        vec![(cuboid(DVec3::ZERO, DVec3::splat(8.0), true), diffuse(0.6))];
    for i in 0..200 {
        let center = random.point() * 6.0 + 1.0;
        let mut corner = || center + (random.point() - 0.5) * 2.0;
        let material = match i % 20 {
            0 => emitter(Vec3::splat(1e6), true),
            1 => emitter(Vec3::splat(1e-6), false),
            _ => Material { double_sided: i % 2 == 0, ..diffuse(0.5) },
        };
        parts.push((vec![[corner(), corner(), corner()]], material));
    }
    if reversed {
        parts.iter_mut().for_each(|p| p.0.reverse());
        parts.reverse();
    }
    let mut scene = empty();
    for (triangles, material) in parts {
        add(&mut scene, &triangles, material);
    }
    add_point_light(&mut scene, DVec3::new(4.0, 7.0, 4.0), 30.0);
    scene
}

#[test]
fn runs_and_triangle_orders_give_the_same_bits() {
    let context = gpu::context();
    for (fill, weights) in [(Fill::Uniform, Weights::D2), (Fill::Coverage, Weights::Extinction)] {
        let settings = Settings { voxels: 16, fill, weights, ..Settings::default() };
        let bits = |reversed: bool| {
            let renderer = gpu::render(&context, &crowd(reversed), &settings, 64);
            let volumes = renderer.resources().volumes.iter();
            let volumes: Vec<_> = volumes.map(|v| gpu::volume_bits(&context, v)).collect();
            let image = renderer.read();
            let image: Vec<u32> =
                image.get(Aov::Beauty).expect("an image").iter().flatten().map(|v| v.to_bits()).collect();
            (volumes, image)
        };
        let first = bits(false);
        assert!(first.1.iter().any(|v| *v != 0));
        for _ in 0..4 {
            assert!(bits(false) == first, "{fill}: two runs differ");
        }
        assert!(bits(true).0 == first.0, "{fill}: the order of the triangles shows");
    }
}
