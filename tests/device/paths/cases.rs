//! The scenes in which paths are compared with the path tracer.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use twobounce::scene::finish::{Anisotropy, Clearcoat, DiffuseTransmission, Finish, Iridescence, Sheen};
use twobounce::scene::sky::Panorama;
use twobounce::scene::{
    Alpha, LightKind, Material, Mesh, Mip, Playback, Pose, Scene, Texture, TextureImage, TextureRef, View, Wrap,
};

use crate::studio::asset;
use crate::{deform, gloss};

/// A scene, a camera and the number of samples.
pub struct Case {
    pub scene: Scene,
    pub pose: Pose,
    pub view: View,
    pub size: u32,
    /// Samples per pixel and part, for both renderers.
    pub samples: u32,
    pub bounces: &'static str,
}

impl Case {
    pub fn new(scene: Scene) -> Self {
        let pose = scene.pose(None, 0.0);
        let view = if scene.cameras.is_empty() { View::framing(scene.bounds(None)) } else { scene.view(&pose, 0) };
        Self { scene, pose, view, size: 32, samples: 4, bounces: "all" }
    }

    pub fn from(self, eye: [f64; 3], target: [f64; 3], degrees: f64) -> Self {
        let view = View::look_at(eye.into(), target.into(), DVec3::Y, degrees.to_radians() as _);
        Self { view, ..self }
    }

    pub fn bounces(self, bounces: &'static str) -> Self {
        Self { bounces, ..self }
    }
}

/// A room of side 4 with an open front, whose walls have different albedos.
fn walls(scene: &mut Scene) {
    let quads = [
        ("floor", Vec3::new(0.7, 0.7, 0.6), Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0),
        ("back", Vec3::new(0.6, 0.65, 0.7), Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 4.0),
        ("left", Vec3::new(0.6, 0.2, 0.1), Vec3::new(-2.0, 0.0, 2.0), Vec3::Z * -4.0, Vec3::Y * 4.0),
        ("right", Vec3::new(0.1, 0.3, 0.6), Vec3::new(2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::Y * 4.0),
    ];
    for (name, albedo, corner, u, v) in quads {
        let material = scene.add_material(Material::lambert(name, albedo));
        scene.add_mesh(Mesh::quad(name, material, corner, u, v), DAffine3::IDENTITY);
    }
}

fn lamp(scene: &mut Scene, radiance: Vec3) {
    let lamp = scene.add_material(Material::lamp("lamp", radiance));
    let quad = Mesh::quad("lamp", lamp, Vec3::new(-0.7, 3.9, -0.7), Vec3::X * 1.4, Vec3::Z * 1.4);
    scene.add_mesh(quad, DAffine3::IDENTITY);
}

/// The room of `walls` with two rows of three spheres.
fn balls(name: &str, materials: Vec<Material>) -> Case {
    let mut scene = Scene::empty(name);
    walls(&mut scene);
    lamp(&mut scene, Vec3::new(9.0, 8.0, 7.0));
    for (i, material) in materials.into_iter().enumerate() {
        let material = scene.add_material(material);
        let at = DVec3::new(-1.2 + 1.2 * (i % 3) as f64, 0.7 + 1.2 * (i / 3) as f64, -0.3 * (i / 3) as f64);
        let ball = gloss::sphere(material, 0.5, 3);
        scene.add_mesh(ball, DAffine3::from_translation(at));
    }
    Case::new(scene).from([0.0, 1.7, 5.5], [0.0, 1.5, 0.0], 40.0)
}

fn finished(material: Material, finish: Finish) -> Material {
    Material { finish: Some(Box::new(finish)), ..material }
}

pub fn finishes() -> Case {
    let red = || Material { specular: 1.0, roughness: 0.6, ..Material::lambert("red", Vec3::new(0.6, 0.1, 0.1)) };
    let metal = |roughness: f32| Material {
        metallic: 1.0,
        specular: 1.0,
        roughness,
        ..Material::lambert("metal", Vec3::new(0.9, 0.7, 0.4))
    };
    let clearcoat = |roughness: f32| Clearcoat { factor: 0.9, roughness, ..Clearcoat::default() };
    let sheen = Sheen { color: Vec3::new(0.3, 0.5, 0.8), roughness: 0.4, ..Sheen::default() };
    let anisotropy = Anisotropy { strength: 0.8, rotation: 0.5, texture: None };
    let iridescence = Iridescence { factor: 1.0, ..Iridescence::default() };
    let diffuse_transmission =
        DiffuseTransmission { factor: 0.6, color: Vec3::new(0.3, 0.8, 0.3), ..DiffuseTransmission::default() };
    balls(
        "finishes",
        vec![
            finished(red(), Finish { clearcoat: clearcoat(0.3), ..Finish::default() }),
            finished(red(), Finish { clearcoat: clearcoat(0.1), sheen: sheen.clone(), ..Finish::default() }),
            finished(red(), Finish { sheen, ..Finish::default() }),
            finished(metal(0.3), Finish { anisotropy, ..Finish::default() }),
            finished(metal(0.25), Finish { iridescence, ..Finish::default() }),
            finished(red(), Finish { diffuse_transmission, ..Finish::default() }),
        ],
    )
}

fn glasses() -> Case {
    let glass = |roughness: f32, thickness: f32| Material {
        ior: 1.5,
        roughness,
        specular: 1.0,
        transmission: 1.0,
        thickness,
        attenuation_color: Vec3::new(0.7, 0.9, 0.8),
        attenuation_distance: 0.8,
        ..Material::lambert("glass", Vec3::new(0.95, 0.9, 0.85))
    };
    let dispersion = Finish { dispersion: 5.0, ..Finish::default() };
    let half = Material { transmission: 0.5, ..glass(0.3, 1.0) };
    balls(
        "glasses",
        vec![
            glass(0.0, 1.0),
            glass(0.4, 1.0),
            finished(glass(0.0, 1.0), dispersion),
            Material { double_sided: true, ..glass(0.0, 0.0) },
            Material { double_sided: true, ..glass(0.4, 0.0) },
            half,
        ],
    )
}

/// A texture of `side`² texels, bilinear.
fn texture(scene: &mut Scene, side: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Option<TextureRef> {
    let rgba = (0..side * side).flat_map(|i| texel(i % side, i / side)).collect();
    scene.images.push(TextureImage { name: "texels".into(), width: side, height: side, rgba });
    let wrap = [Wrap::Repeat, Wrap::Repeat];
    let image = scene.images.len() - 1;
    scene.textures.push(Texture { image, wrap, mag_linear: true, min_linear: true, mip: Mip::Linear });
    let texture = scene.textures.len() - 1;
    Some(TextureRef { texture, uv_set: 0, transform: glam::Affine2::from_scale(Vec2::splat(2.0)) })
}

/// A scene with an alpha-masked fence, two blended veils one behind the other, a pane, and a textured lamp.
fn veils() -> Case {
    let mut scene = Scene::empty("veils");
    walls(&mut scene);
    let checks = texture(&mut scene, 8, |x, y| if (x / 2 + y / 2) % 2 == 0 { [255; 4] } else { [40, 90, 200, 30] });
    let picture = texture(&mut scene, 4, |x, y| [255, (60 * x) as u8, (60 * y) as u8, 255]);
    let sheet = |name: &str, albedo: Vec3| Material { double_sided: true, ..Material::lambert(name, albedo) };
    let fence = Material { base_color_texture: checks, alpha: Alpha::Mask(0.5), ..sheet("fence", Vec3::splat(0.8)) };
    let veil = Material {
        base_color: Vec4::new(0.9, 0.4, 0.3, 0.6),
        base_color_texture: checks,
        alpha: Alpha::Blend,
        ..sheet("veil", Vec3::ONE)
    };
    let pane = Material { transmission: 0.8, roughness: 0.0, specular: 1.0, ..sheet("pane", Vec3::new(0.6, 0.9, 0.7)) };
    let glow = Material { emissive_texture: picture, ..Material::lamp("glow", Vec3::new(9.0, 9.0, 9.0)) };
    let [fence, veil, pane, glow] = [fence, veil, pane, glow].map(|material| scene.add_material(material));
    let mut quad = |material: usize, corner: [f32; 3], u: [f32; 3], v: [f32; 3]| {
        let mesh = Mesh::quad("sheet", material, corner.into(), u.into(), v.into());
        scene.add_mesh(mesh, DAffine3::IDENTITY);
    };
    quad(fence, [-1.8, 0.2, -0.5], [1.4, 0.0, 0.3], [0.0, 1.8, 0.0]);
    quad(veil, [-0.6, 0.3, 0.2], [1.2, 0.0, 0.0], [0.0, 1.5, 0.0]);
    quad(veil, [-0.3, 0.6, -0.6], [1.2, 0.0, 0.2], [0.0, 1.7, 0.1]);
    quad(pane, [0.7, 0.2, 0.3], [1.1, 0.0, -0.4], [0.0, 1.6, 0.0]);
    quad(glow, [-0.9, 3.8, -0.9], [1.8, 0.0, 0.0], [0.0, 0.0, 1.8]);
    let light = DAffine3::from_translation(DVec3::new(1.2, 3.0, 1.0));
    let light = scene.add_light(LightKind::Point, Vec3::new(3.0, 3.0, 4.0), light);
    scene.lights[light].radius = 0.2;
    Case::new(scene).from([0.0, 1.7, 5.5], [0.0, 1.3, 0.0], 40.0)
}

/// A sky map with a sun and a softbox over a metal ball, a diffuse one and a rough dielectric on a floor.
fn sky(turned: f64) -> Case {
    let mut scene = Scene::empty("sky map");
    let sun = DVec3::new(0.5, 0.7, 0.4).normalize();
    let texel = |d: DVec3| {
        let of_sky = Vec3::new(0.3, 0.4, 0.7) * (0.6 + 0.4 * d.y as f32);
        let is_sun = d.dot(sun) > 0.995;
        let in_box = (d - DVec3::new(-0.7, 0.3, 0.64)).abs().max_element() < 0.15;
        of_sky
            + if is_sun { Vec3::new(60.0, 50.0, 40.0) } else { Vec3::ZERO }
            + Vec3::splat(8.0 * f32::from(in_box as u8))
    };
    let (width, height) = (64, 32);
    let place = |i: usize| ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    let towards = |i: usize| twobounce::scene::sky::direction(place(i).0 / width as f64, place(i).1 / height as f64);
    let radiance = (0..width * height).map(|i| texel(towards(i))).collect();
    scene.set_sky_map(Panorama { width, height, radiance }, 1.0, turned);
    let floor = scene.add_material(Material::lambert("floor", Vec3::new(0.5, 0.45, 0.4)));
    let quad = Mesh::quad("floor", floor, Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::Z * -6.0);
    scene.add_mesh(quad, DAffine3::IDENTITY);
    let metal =
        Material { metallic: 1.0, roughness: 0.15, specular: 1.0, ..Material::lambert("metal", Vec3::splat(0.9)) };
    let lacquer = Material { roughness: 0.4, specular: 1.0, ..Material::lambert("lacquer", Vec3::new(0.1, 0.3, 0.2)) };
    let dull = Material::lambert("dull", Vec3::splat(0.7));
    for (i, material) in [metal, lacquer, dull].into_iter().enumerate() {
        let material = scene.add_material(material);
        let at = DVec3::new(-1.2 + 1.2 * i as f64, 0.5, 0.0);
        scene.add_mesh(gloss::sphere(material, 0.5, 3), DAffine3::from_translation(at));
    }
    Case::new(scene).from([0.0, 1.6, 4.5], [0.0, 0.5, 0.0], 40.0)
}

/// Lights of every kind, with and without a radius, in a room with so many small lamps that they are sampled through
/// the tree.
fn lights() -> Case {
    let mut scene = Scene::empty("lights");
    walls(&mut scene);
    let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    let down = DAffine3::from_rotation_x(-PI / 2.0);
    let ball = scene.add_light(LightKind::Point, Vec3::new(3.0, 1.0, 1.0), at(-1.0, 1.5, 0.5));
    scene.lights[ball].radius = 0.3;
    scene.add_light(LightKind::Point, Vec3::new(1.0, 3.0, 1.0), at(1.2, 2.5, 0.0));
    scene.add_light(LightKind::Spot { inner: 0.3, outer: 0.6 }, Vec3::splat(12.0), at(0.0, 3.5, 0.0) * down);
    let sun = DAffine3::from_rotation_y(0.6) * DAffine3::from_rotation_x(-0.5);
    let sun = scene.add_light(LightKind::Directional, Vec3::new(0.4, 0.4, 0.8), sun);
    scene.lights[sun].radius = 0.1;
    for i in 0..24u32 {
        let strength = 1.0 + (i % 5) as f32;
        let glow = scene.add_material(Material {
            double_sided: i % 4 == 0,
            ..Material::lamp("glow", Vec3::new(strength, 0.5 * strength, 2.0))
        });
        let (x, z) = ((i % 6) as f32 * 0.6 - 1.6, (i / 6) as f32 * 0.8 - 1.6);
        let quad = Mesh::quad("glow", glow, Vec3::new(x, 3.0, z), Vec3::X * 0.2, Vec3::Z * 0.2);
        scene.add_mesh(quad, DAffine3::IDENTITY);
    }
    let lacquer = Material { roughness: 0.3, specular: 1.0, ..Material::lambert("lacquer", Vec3::new(0.2, 0.3, 0.5)) };
    let lacquer = scene.add_material(lacquer);
    let block = Mesh::cuboid("block", lacquer, Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.6, 1.2, 0.3), false);
    scene.add_mesh(block, DAffine3::from_rotation_y(0.4));
    Case::new(scene).from([0.0, 1.7, 5.5], [0.0, 1.5, 0.0], 40.0)
}

/// An animated skin and morph target on two bars, one of which emits light.
fn skins() -> Case {
    let scene = Scene { name: "skins".into(), ..deform::room() };
    let playback = Playback { animations: vec![0, 1], repeats: false };
    let pose = scene.pose_of(&playback, 0.6);
    Case { pose, view: deform::view(), ..Case::new(scene) }
}

fn even_sky() -> Case {
    let mut scene = gloss::corner();
    scene.sky_gradient = Vec3::new(0.2, 0.4, 0.6);
    Case::new(scene)
}

/// All cases; the quick test renders them at 32² pixels.
pub fn cases() -> Vec<Case> {
    let of_asset = |name: &str| Case::new(asset(name));
    vec![
        of_asset("cornell-point.glb"),
        // The edges of a visible lamp need more sample positions within pixels.
        Case { samples: 12, ..of_asset("cornell-area.glb").bounces("1") },
        of_asset("gallery.glb"),
        of_asset("two-rooms.glb").bounces("2"),
        Case::new(gloss::spheres(true)),
        Case::new(gloss::spheres(false)).bounces("2"),
        even_sky(),
        sky(30.0),
        lights(),
        finishes(),
        glasses(),
        veils(),
        skins(),
    ]
}
