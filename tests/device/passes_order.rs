//! A frame gives equal bits every time: over several runs, and with the triangles in another order.

use crate::gpu;

use std::sync::Arc;

use crate::scenes::{Random, add, triangle};
use glam::{DAffine3, DVec3, Vec3};
use twobounce::layers::Aov;
use twobounce::scene::{LightKind, Material, Mesh, Scene};
use twobounce::settings::Settings;
use twobounce::vk::{Context, Format, Image, download_image};

/// A lit room full of triangles that share voxels, lamps of 10⁻⁶ and 10⁶ among them.
fn crowd(reversed: bool) -> Scene {
    let mut random = Random::new(4);
    let mut parts: Vec<([DVec3; 3], Material)> = Vec::new();
    for i in 0..200 {
        let center = random.point() * 6.0 + 1.0;
        let grey = Material::lambert("grey", Vec3::splat(0.5));
        let material = match i % 20 {
            0 => Material::lamp("bright", Vec3::splat(1e6)),
            1 => Material::lamp("dim", Vec3::splat(1e-6)),
            _ => Material { double_sided: i % 2 == 0, ..grey },
        };
        parts.push((triangle(&mut random, center, 2.0), material));
    }
    if reversed {
        parts.reverse();
    }
    let mut scene = Scene::empty("crowd");
    let walls = scene.add_material(Material::lambert("walls", Vec3::splat(0.6)));
    scene.add_mesh(Mesh::cuboid("room", walls, Vec3::ZERO, Vec3::splat(8.0), true), DAffine3::IDENTITY);
    for (triangle, material) in parts {
        add(&mut scene, &[triangle], material);
    }
    if reversed {
        scene.meshes.reverse();
        let last = scene.meshes.len() - 1;
        scene.instances.iter_mut().for_each(|instance| instance.mesh = last - instance.mesh);
        scene.instances.reverse();
    }
    scene.add_light(LightKind::Point, Vec3::splat(30.0), DAffine3::from_translation(DVec3::new(4.0, 7.0, 4.0)));
    scene
}

type Bits = (Vec<Vec<u8>>, Vec<u32>);

/// The bits of all levels of the method's volumes, and of the image.
fn bits(context: &Arc<Context>, settings: &Settings, reversed: bool) -> Bits {
    let renderer = gpu::render(context, &crowd(reversed), settings, 64);
    let level = |image: &Image, k: u32| -> Vec<u8> {
        if image.format() == Format::R32G32B32A32_SFLOAT {
            bytemuck::cast_slice(&download_image::<[f32; 4]>(context, image, k).expect("a level")).to_vec()
        } else {
            bytemuck::cast_slice(&download_image::<[u16; 4]>(context, image, k).expect("a level")).to_vec()
        }
    };
    let levels = |image| (0..Image::mips(image)).map(move |k| level(image, k)).collect::<Vec<_>>();
    let volumes = renderer.frame().method.images().into_iter().flat_map(levels).collect();
    let image = renderer.read();
    let beauty = image.get(Aov::Beauty).expect("an image");
    (volumes, beauty.iter().flatten().map(|v| v.to_bits()).collect())
}

#[test]
fn runs_and_triangle_orders_give_the_same_bits() {
    let context = gpu::context();
    for [fill, weights] in
        [["cones.fill=uniform", "cones.weights=d2"], ["cones.fill=coverage", "cones.weights=extinction"]]
    {
        let settings = gpu::with(Settings { voxels: 16, ..Settings::corrected() }, &[fill, weights]);
        let first = bits(&context, &settings, false);
        assert!(first.1.iter().any(|v| *v != 0));
        for _ in 0..2 {
            assert!(bits(&context, &settings, false) == first, "{fill}: two runs differ");
        }
        assert!(bits(&context, &settings, true).0 == first.0, "{fill}: the order of the triangles shows");
    }
}

#[test]
fn photons_give_the_same_bits_in_every_order() {
    let context = gpu::context();
    for settings in [Settings::photons(), Settings::photons_printed()] {
        let settings =
            gpu::with(settings, &["voxels=16", "photons.diffuse=2", "photons.bounce=1", "lights.lamps=gathered"]);
        let first = bits(&context, &settings, false);
        assert!(first.0.iter().flatten().any(|byte| *byte != 0) && first.1.iter().any(|v| *v != 0));
        assert!(bits(&context, &settings, false) == first, "two runs differ");
        assert!(bits(&context, &settings, true).0 == first.0, "the order of the triangles shows");
    }
}

/// Light propagation sums its lights cell by cell.
#[test]
fn propagated_light_has_the_same_bits_in_every_order() {
    let context = gpu::context();
    for settings in [Settings::lpv(), Settings::lpv_printed()] {
        let changes = ["voxels=16", "lpv.edge=16", "lpv.iterations=8", "lights.lamps=gathered"];
        let settings = gpu::with(settings, &changes);
        let first = bits(&context, &settings, false);
        assert!(first.0.iter().flatten().any(|byte| *byte != 0) && first.1.iter().any(|v| *v != 0));
        for _ in 0..2 {
            assert!(bits(&context, &settings, false) == first, "two runs differ");
        }
        assert!(bits(&context, &settings, true).0 == first.0, "the order of the triangles shows");
    }
}

/// With rays, sampled lamps, and one lit triangle for each group: the lamps' order is the scene's.
#[test]
fn runs_of_fast_give_the_same_bits() {
    let context = gpu::context();
    for changes in [vec!["voxels=16"], vec!["voxels=16", "bounces=all", "rays.passes=4"]] {
        let settings = gpu::with(Settings::fast(), &changes);
        let first = bits(&context, &settings, false);
        assert!(first.1.iter().any(|v| *v != 0));
        for _ in 0..2 {
            assert!(bits(&context, &settings, false) == first);
        }
    }
}
