//! A small scene prepared on a host's device, and frames of it. Every test file uses a part of this.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use twobounce::ash::vk;
use twobounce::host::{Aov, Context, Layers, Output, Prepare, Prepared, Seen};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Pose, Scene, View};
use twobounce::settings::Settings;

use super::images::TestImage;
use super::{Frame, Host};

pub const SIZE: (u32, u32) = (24, 16);

pub fn room() -> Scene {
    let mut scene = Scene::empty("room");
    let walls = scene.add_material(Material { double_sided: true, ..Material::lambert("walls", Vec3::splat(0.6)) });
    scene.add_mesh(Mesh::cuboid("walls", walls, Vec3::ZERO, Vec3::splat(4.0), true), DAffine3::IDENTITY);
    let red = scene.add_material(Material::lambert("box", Vec3::new(0.7, 0.2, 0.1)));
    scene.add_mesh(Mesh::cuboid("box", red, Vec3::splat(1.0), Vec3::splat(2.2), false), DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::splat(8.0), DAffine3::from_translation(DVec3::new(3.0, 3.0, 3.0)));
    scene
}

pub fn view() -> View {
    View::look_at(DVec3::new(3.5, 2.0, 3.4), DVec3::splat(1.5), DVec3::Y, 1.2)
}

pub fn settings(changes: &[&str]) -> Settings {
    let mut settings = Settings::fast();
    ["voxels=16"].iter().chain(changes).for_each(|change| settings.set(change).expect("a setting"));
    settings
}

/// A host, what it prepared, and one frame.
pub struct Setup {
    pub prepared: Prepared,
    pub context: Arc<Context>,
    pub frame: Frame,
    pub scene: Scene,
    pub pose: Pose,
    pub host: Host,
}

impl Setup {
    pub fn new(scene: Scene, settings: &Settings, layers: &[Aov]) -> Self {
        let host = Host::new();
        let context = host.adopt(|_| ()).expect("everything is enabled");
        let pose = scene.pose(None, 0.0);
        let prepare = Prepare { layers: layers.to_vec(), ..Prepare::new(SIZE, scene.bounds(None)) };
        let prepared = Prepared::new(&context, &scene, &pose, settings, &prepare).expect("it fits");
        Self { prepared, context, frame: Frame::new(&host), scene, pose, host }
    }

    /// Renders a frame over slot 0, with the host's commands after it, and waits.
    pub fn draw(&mut self, outputs: &[Output], after: impl FnOnce(vk::CommandBuffer)) {
        let (view, taken) = (view(), self.context.allocated_bytes());
        self.frame.begin();
        // SAFETY: the frame was waited for, and so is this one.
        unsafe {
            self.prepared.record(self.frame.commands, 0, &Seen::new(&self.scene, &self.pose, &view), outputs);
        }
        after(self.frame.commands);
        self.frame.submit(&self.host);
        assert_eq!(self.context.allocated_bytes(), taken, "a frame takes no memory");
        self.frame.wait();
    }

    /// The texels of a layer, as the host copies them.
    pub fn texels(&mut self, layer: Aov) -> Vec<[f32; 4]> {
        let found = self.prepared.layer(layer).expect("prepared");
        let buffer = TestImage::readback(&self.host, SIZE.0 * SIZE.1 * 16);
        let device = self.host.device.clone();
        self.draw(&[], |commands| {
            buffer.copy(&device, commands, (found.image, vk::ImageLayout::GENERAL), SIZE, (0, 0))
        });
        let texels = buffer.read(&self.host);
        buffer.destroy(&self.host);
        texels
    }

    pub fn close(self) {
        assert_eq!(self.host.take_messages(), Vec::<String>::new());
        drop((self.prepared, self.context, self.frame));
        self.host.close();
    }
}

/// What a renderer of its own draws.
pub fn rendered(setup: &Setup, settings: &Settings, aovs: &[Aov], size: (u32, u32)) -> Layers {
    let options = RenderOptions { aovs: aovs.to_vec(), ..RenderOptions::new(size, setup.scene.bounds(None)) };
    let scene = setup.scene.clone();
    let mut renderer = Renderer::new(&setup.context, scene, &setup.pose, settings.clone(), options).expect("it fits");
    renderer.render(&setup.pose, &view()).expect("a frame");
    renderer.read()
}
