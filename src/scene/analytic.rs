//! Scenes made in code whose radiance a formula gives. Units: SI, see [`super`].

use glam::{DAffine3, DVec3, Vec3};

use super::{Material, Mesh, Scene, View};

/// A closed box of side 2 around the origin. Every surface is diffuse with `albedo` and emits the radiance `emission`.
/// After n bounces the radiance is `emission` · Σ albedoᵏ, k = 0…n, everywhere. `block` adds a rotated box of the same
/// material.
pub fn furnace(albedo: f32, emission: f32, block: bool) -> Scene {
    let mut scene = Scene::empty("furnace");
    let wall = Material { emissive: Vec3::splat(emission), ..Material::lambert("wall", Vec3::splat(albedo)) };
    let wall = scene.add_material(wall);
    scene.add_mesh(Mesh::cuboid("box", wall, Vec3::NEG_ONE, Vec3::ONE, true), DAffine3::IDENTITY);
    if block {
        let block = Mesh::cuboid("block", wall, Vec3::splat(-0.4), Vec3::splat(0.4), false);
        // The box is rotated, so that its sides are not parallel to the grid's planes.
        scene.add_mesh(block, DAffine3::from_rotation_y(0.5) * DAffine3::from_rotation_x(0.3));
    }
    scene.add_camera(&View::look_at(DVec3::new(0.55, 0.35, 0.9), DVec3::ZERO, DVec3::Y, 75f32.to_radians()));
    scene
}
