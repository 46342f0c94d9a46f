//! A lit room with a movable box, and a renderer that is kept from frame to frame. Every test file uses a part of this.
#![allow(dead_code)]

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use twobounce::layers::Aov;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, LoadOptions, Material, Mesh, Pose, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::Context;

use crate::gpu;
use crate::scenes::{Random, add, triangle};

/// A lit room with objects that share voxels; its last instance is the movable one.
pub fn room() -> Scene {
    let (mut scene, mut random) = (Scene::empty("room"), Random::new(8));
    let walls = scene.add_material(Material { double_sided: true, ..Material::lambert("walls", Vec3::splat(0.6)) });
    scene.add_mesh(Mesh::cuboid("room", walls, Vec3::ZERO, Vec3::splat(8.0), true), DAffine3::IDENTITY);
    for i in 0..40 {
        let center = random.point() * 6.0 + 1.0;
        let shiny = Material { metallic: 0.5, roughness: 0.3, ..Material::lambert("shiny", random.point().as_vec3()) };
        let material = if i % 8 == 0 { Material::lamp("lamp", random.point().as_vec3()) } else { shiny };
        add(&mut scene, &[triangle(&mut random, center, 2.0)], Material { double_sided: i % 2 == 0, ..material });
    }
    let boxed = scene.add_material(Material::lambert("box", Vec3::new(0.7, 0.3, 0.2)));
    scene.add_mesh(Mesh::cuboid("box", boxed, Vec3::ZERO, Vec3::splat(1.5), false), DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::splat(30.0), DAffine3::from_translation(DVec3::new(4.0, 7.0, 4.0)));
    scene
}

/// The room with its box at `at`, metres.
pub fn pose(scene: &Scene, at: DVec3) -> Pose {
    let mut pose = scene.pose(None, 0.0);
    *pose.world_from_instance.last_mut().expect("a box") = DAffine3::from_translation(at);
    pose
}

/// The room unchanged, with its box moved, and with its light moved too.
pub fn moved_poses(scene: &Scene) -> [Pose; 3] {
    let (here, there) = (pose(scene, DVec3::new(1.0, 1.0, 1.0)), pose(scene, DVec3::new(5.0, 4.0, 3.0)));
    let mut lit = there.clone();
    lit.lights[0].position += DVec3::new(1.0, 0.0, -1.0);
    [here, there, lit]
}

/// A scene of `assets/`.
pub fn asset(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name);
    Scene::load(&path, &LoadOptions::default()).expect("it loads")
}

/// Half-floats of volumes, indexed by volume, face and level.
pub type Volumes = Vec<Vec<Vec<Vec<[u16; 4]>>>>;

pub struct Studio {
    pub context: Arc<Context>,
    pub renderer: Renderer,
    pub view: View,
}

impl Studio {
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        Self::of_size(scene, settings, 16)
    }

    /// Images are `size` pixels wide and high.
    pub fn of_size(scene: &Scene, settings: &Settings, size: u32) -> Self {
        let context = gpu::context();
        let options = RenderOptions::new((size, size), scene.bounds(None));
        let pose = scene.pose(None, 0.0);
        let renderer = Renderer::new(&context, scene.clone(), &pose, settings.clone(), options).expect("it fits");
        Self { context, renderer, view: View::framing(scene.bounds(None)) }
    }

    /// The bits of both volumes after a frame.
    pub fn volumes(&mut self, pose: &Pose) -> Volumes {
        self.renderer.render(pose, &self.view).expect("a frame");
        assert_eq!(self.context.take_validation_messages(), Vec::<String>::new());
        self.renderer.frame().method.volumes().iter().map(|v| gpu::volume_bits(&self.context, v)).collect()
    }

    /// The bits of the image of a frame, and the names of its passes.
    pub fn image(&mut self, pose: &Pose) -> (Vec<u32>, Vec<&'static str>) {
        let report = self.renderer.render(pose, &self.view).expect("a frame");
        assert_eq!(self.context.take_validation_messages(), Vec::<String>::new());
        let image = self.renderer.read();
        let beauty = image.get(Aov::Beauty).expect("an image");
        let bits = beauty.iter().flatten().map(|v| v.to_bits()).collect();
        (bits, report.timings.zones.iter().map(|zone| zone.name).collect())
    }
}
