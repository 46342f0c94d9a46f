//! A small scene prepared on a host's device, and frames of it. Every test file uses a part of this.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use twobounce::ash::vk;
use twobounce::host::{Aov, Context, Counters, Growth, HostImage, ImageUse, Layers, Output, Prepare, Prepared, Shot};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Pose, Scene, View};
use twobounce::settings::Settings;

use super::images::TestImage;
use super::{Host, HostFrame};

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

/// A host, its prepared scene, and one frame.
pub struct Setup {
    pub prepared: Prepared,
    pub context: Arc<Context>,
    pub frame: HostFrame,
    pub scene: Scene,
    pub pose: Pose,
    pub host: Host,
    /// Which pass over an image [`Self::given_light`] renders.
    pub pass: u32,
}

impl Setup {
    pub fn new(scene: Scene, settings: &Settings, layers: &[Aov]) -> Self {
        let host = Host::new();
        let context = host.adopt(|_| ()).expect("everything is enabled");
        let pose = scene.pose(None, 0.0);
        let prepare = Prepare { layers: layers.to_vec(), ..Prepare::new(SIZE, scene.bounds(None)) };
        let prepared = Prepared::new(&context, &scene, &pose, settings, &prepare).expect("it fits");
        Self { prepared, context, frame: HostFrame::new(&host), scene, pose, host, pass: 0 }
    }

    /// As [`Prepared::poll`] of slot 0.
    pub fn poll(&self) -> Option<Growth> {
        // SAFETY: every frame is waited for.
        unsafe { self.prepared.poll(0) }
    }

    /// As [`Prepared::counters`] of slot 0.
    pub fn counters(&self) -> Option<Counters> {
        // SAFETY: every frame is waited for.
        unsafe { self.prepared.counters(0) }
    }

    /// As [`Prepared::grow`]; fails if the lists do not fit.
    pub fn grow(&mut self, growth: Growth) {
        // SAFETY: every frame is waited for.
        unsafe { self.prepared.grow(growth) }.expect("it fits");
    }

    /// As [`Prepared::change`] with the same scene; fails if it does not fit.
    pub fn change(&mut self, settings: &Settings, prepare: &Prepare) {
        // SAFETY: every frame is waited for.
        unsafe { self.prepared.change(&self.scene, settings, prepare) }.expect("it fits");
    }

    /// Renders a frame over slot 0, with the host's commands after it, and waits.
    pub fn draw(&mut self, outputs: &[Output], after: impl FnOnce(vk::CommandBuffer)) {
        let (view, taken) = (view(), self.context.allocated_bytes());
        self.frame.begin();
        // SAFETY: the frame was waited for, and so is this one.
        unsafe {
            self.prepared.record(self.frame.commands, 0, &Shot::new(&self.scene, &self.pose, &view), outputs);
        }
        after(self.frame.commands);
        self.frame.submit(&self.host);
        assert_eq!(self.context.allocated_bytes(), taken, "a frame takes no memory");
        self.frame.wait();
    }

    /// The texels of a layer, in the host's copy.
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

    /// Direct and indirect light of a frame's own surfaces: its layers go to images of the host, and return as its
    /// inputs. `material`: roughness, metallic and specular for a base colour; surfaces are Lambertian without it.
    pub fn given_light(&mut self, material: Option<&dyn Fn([f32; 4]) -> [f32; 3]>) -> [Vec<[f32; 4]>; 2] {
        let formats = [vk::Format::R32_SFLOAT, vk::Format::R16G16B16A16_SFLOAT, vk::Format::R32G32B32A32_SFLOAT];
        let formats = formats.into_iter().chain([vk::Format::R32G32B32A32_SFLOAT; 3]);
        let images: Vec<_> =
            formats.map(|format| (TestImage::new(&self.host, format, (2 * SIZE.0, 2 * SIZE.1)), format)).collect();
        let place = |i: usize, before: vk::ImageLayout, after: vk::ImageLayout| {
            let (stages, access) = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE);
            let access = access | vk::AccessFlags2::TRANSFER_READ;
            let state = |layout| ImageUse { stages, access, layout };
            let (image, format) = (images[i].0.image, images[i].1);
            HostImage { image, format, size: SIZE, level: 1, layer: 1, before: state(before), after: state(after) }
        };
        use vk::ImageLayout as L;
        // The combined image of single numbers has depth in another channel, so the host's own depth is made from it.
        let drawn = [(1, Aov::Normal), (2, Aov::Albedo)]
            .map(|(i, layer)| self.prepared.output(layer, place(i, L::UNDEFINED, L::GENERAL)).expect("an output"));
        let depth = self.texels(Aov::Depth);
        let channel = self.prepared.layer(Aov::Depth).and_then(|layer| layer.channel).expect("one number");
        let mut depth: Vec<f32> = depth.iter().map(|texel| texel[channel]).collect();
        depth[0] = 0.0; // nothing is there
        let of_pixel = |texel: &[f32; 4]| material.map_or([0.0; 3], |material| material(*texel));
        let materials: Vec<[f32; 4]> = self
            .texels(Aov::Albedo)
            .iter()
            .map(of_pixel)
            .map(|[roughness, metallic, specular]| [roughness, metallic, specular, 0.0])
            .collect();
        let uploads = [TestImage::upload(&self.host, &depth), TestImage::upload(&self.host, materials.as_flattened())];
        let device = self.host.device.clone();
        let targets = [images[0].0.image, images[5].0.image];
        self.draw(&drawn, |commands| {
            uploads
                .iter()
                .zip(targets)
                .for_each(|(upload, image)| upload.copy_to(&device, commands, image, SIZE, (1, 1)));
        });
        let inputs = [(0, L::TRANSFER_DST_OPTIMAL), (1, L::GENERAL), (2, L::GENERAL)];
        let [depth, normal, albedo] = inputs.map(|(i, before)| place(i, before, L::GENERAL));
        let material = material.map(|_| place(5, L::TRANSFER_DST_OPTIMAL, L::GENERAL));
        let inputs = self.prepared.inputs(depth, normal, albedo, material).expect("inputs");
        let lights = [(3, Aov::Direct), (4, Aov::Indirect)].map(|(i, layer)| {
            self.prepared.given_output(layer, place(i, L::UNDEFINED, L::GENERAL)).expect("an output")
        });
        let buffers = [0; 2].map(|_| TestImage::readback(&self.host, SIZE.0 * SIZE.1 * 16));
        let view = view();
        self.frame.begin();
        // SAFETY: the frame was waited for, and so is this one.
        unsafe {
            let seen = Shot { image: Some(self.pass), ..Shot::new(&self.scene, &self.pose, &view) };
            self.prepared.record_given(self.frame.commands, 0, &seen, &inputs, &lights);
        }
        for (i, buffer) in buffers.iter().enumerate() {
            buffer.copy(&device, self.frame.commands, (images[3 + i].0.image, L::GENERAL), SIZE, (1, 1));
        }
        self.frame.submit(&self.host);
        self.frame.wait();
        let found = [0, 1].map(|i| buffers[i].read(&self.host));
        images.into_iter().for_each(|(image, _)| image.destroy(&self.host));
        buffers.into_iter().chain(uploads).for_each(|buffer| buffer.destroy(&self.host));
        found
    }

    pub fn close(self) {
        assert_eq!(self.host.take_messages(), Vec::<String>::new());
        drop((self.prepared, self.context, self.frame));
        self.host.close();
    }
}

/// The layers of a separate renderer.
pub fn rendered(setup: &Setup, settings: &Settings, aovs: &[Aov], size: (u32, u32)) -> Layers {
    let options = RenderOptions { aovs: aovs.to_vec(), ..RenderOptions::new(size, setup.scene.bounds(None)) };
    let scene = setup.scene.clone();
    let mut renderer = Renderer::new(&setup.context, scene, &setup.pose, settings.clone(), options).expect("it fits");
    renderer.render(&setup.pose, &view()).expect("a frame");
    renderer.read()
}
