//! Scenes of different kinds, made of one: each adds one feature to a plain box with a point light.

use glam::{DAffine3, DVec3, Vec3, Vec4};
use twobounce::scene::sky::Panorama;
use twobounce::scene::{Alpha, LightKind, Material, Mesh, Scene};

/// Pixels along a map of the sky.
const WIDTH: usize = 32;

/// These scenes, each named after its feature.
pub fn kinds(plain: &Scene) -> Vec<Scene> {
    let with = |name: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = Scene { name: name.to_owned(), ..plain.clone() };
        change(&mut scene);
        scene
    };
    let dark = |scene: &mut Scene| scene.lights.clear();
    let even = |scene: &mut Scene| scene.sky = Vec3::new(0.3, 0.4, 0.6);
    let map = |scene: &mut Scene, sun: f32| {
        let pixel = |i: usize| match (i / WIDTH, i % WIDTH) {
            (3, 5) => Vec3::splat(sun),
            (row, column) => Vec3::new(0.3, 0.4, 0.6) * (1.0 + (row + column) as f32 / WIDTH as f32),
        };
        let radiance = (0..WIDTH * WIDTH / 2).map(pixel).collect();
        scene.set_sky_map(Panorama { width: WIDTH, height: WIDTH / 2, radiance }, 1.0, 0.0);
    };
    let pane = |scene: &mut Scene, material: Material| {
        let material = scene.add_material(Material { double_sided: true, ..material });
        let size = Vec3::new(0.8, 0.8, 0.01);
        scene.add_mesh(Mesh::cuboid("pane", material, -size, size, false), DAffine3::from_translation(DVec3::Z * 0.5));
    };
    let glossy = Material { metallic: 1.0, roughness: 0.3, ..Material::lambert("metal", Vec3::splat(0.8)) };
    let blended = Material {
        alpha: Alpha::Blend,
        base_color: Vec4::new(0.8, 0.4, 0.3, 0.5),
        ..Material::lambert("b", Vec3::ONE)
    };
    let masked = Material { alpha: Alpha::Mask(0.5), ..Material::lambert("masked", Vec3::splat(0.5)) };
    let glass = Material { transmission: 1.0, roughness: 0.0, ..Material::lambert("glass", Vec3::splat(0.9)) };
    vec![
        with("no light", &dark),
        with("even sky alone", &|scene| {
            dark(scene);
            even(scene)
        }),
        with("sky with a gradient", &|scene| {
            even(scene);
            scene.sky_gradient = Vec3::splat(0.2)
        }),
        with("map of the sky", &|scene| map(scene, 0.5)),
        with("map with a sun", &|scene| map(scene, 5000.0)),
        with("sun", &|scene| {
            scene.add_light(LightKind::Directional, Vec3::ONE, DAffine3::IDENTITY);
        }),
        with("lamp", &|scene| pane(scene, Material::lamp("lamp", Vec3::ONE))),
        with("metal", &|scene| pane(scene, glossy.clone())),
        with("glass", &|scene| pane(scene, glass.clone())),
        with("mask", &|scene| pane(scene, masked.clone())),
        with("blending", &|scene| pane(scene, blended.clone())),
    ]
}
