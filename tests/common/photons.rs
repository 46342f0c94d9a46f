//! GLSL functions of the method `photons`, evaluated by `glsl/test/photons.comp`, and a volume for them that tests
//! fill.
#![allow(dead_code)]

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use half::f16;
use twobounce::gi::photons::{PHOTON_VOLUME, constants};
use twobounce::ground::constants::with;
use twobounce::ground::layout;
use twobounce::ground::volume::LightVolume;
use twobounce::settings::Settings;
use twobounce::vk::*;

use crate::gpu;

/// The number of each function in the shader's `evaluate`.
#[derive(Clone, Copy)]
pub enum Function {
    Octahedron,
    Texel,
    Folded,
    Spheres,
    OpacityOver,
    TraceCone,
}

/// Three vectors in, three out.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Arguments(pub [[f32; 4]; 3]);

impl Arguments {
    pub fn of_vectors(a: Vec4, b: Vec4) -> Self {
        Self([a.into(), b.into(), [0.0; 4]])
    }

    pub fn a(&self) -> Vec4 {
        Vec4::from_array(self.0[0])
    }

    pub fn b(&self) -> Vec4 {
        Vec4::from_array(self.0[1])
    }
}

pub const EDGE: u32 = 16;

/// A device with an empty volume.
pub struct PhotonGpu {
    context: Arc<Context>,
    volume: LightVolume,
}

impl PhotonGpu {
    pub fn new() -> Self {
        let context = gpu::context();
        let volume = LightVolume::new(&context, PHOTON_VOLUME, 0, EDGE).expect("a volume");
        let this = Self { context, volume };
        this.fill(|_, _| (Vec4::ZERO, Vec4::ZERO));
        this
    }

    /// Fills the volume. `of` gives for a level and a texel in it the light sent in every direction (premultiplied, and
    /// its area) and the opacity for travellers along the axes in both directions (and the share of samples).
    pub fn fill(&self, of: impl Fn(u32, [u32; 3]) -> (Vec4, Vec4)) {
        self.fill_directions(|level, at, _| of(level, at));
    }

    /// As [`Self::fill`], with separate light for each of the sixteen directions: the last argument is the direction's
    /// texel. The opacities along the axes are those of texel 0.
    pub fn fill_directions(&self, of: impl Fn(u32, [u32; 3], u32) -> (Vec4, Vec4)) {
        for level in 0..self.volume.levels {
            let edge = EDGE >> level;
            let texels = |across: u32, pick: &dyn Fn([u32; 3], u32) -> Vec4| -> Vec<[u16; 4]> {
                let place = |i: u32| {
                    let width = across * edge;
                    let (x, y) = (i % width, i / width % width);
                    ([x % edge, y % edge, i / (width * width)], y / edge * across + x / edge)
                };
                let bits = |v: Vec4| v.to_array().map(|x| f16::from_f32(x).to_bits());
                let texel = |i: u32| {
                    let (at, direction) = place(i);
                    bits(pick(at, direction))
                };
                (0..across * across * edge.pow(3)).map(texel).collect()
            };
            let sent = texels(4, &|at, texel| of(level, at, texel).0);
            let hidden = texels(1, &|at, _| of(level, at, 0).1);
            for (image, texels) in self.volume.images.iter().zip([&sent, &hidden, &hidden]) {
                upload_image(&self.context, image, ImageRegion::level(image, level), texels).expect("an upload");
            }
        }
    }

    pub fn evaluate(&self, function: Function, inputs: &[Arguments], settings: &Settings) -> Vec<Arguments> {
        let c = &self.context;
        let own = [("EDGE", EDGE.into()), ("FUNCTION", (function as u32).into())];
        let constants = with(constants::constants(&settings.of.photons), &own);
        let desc = ComputeDesc { label: "photons", shader: "test/photons.comp", constants: &constants };
        let pipeline = Compute::new(c, &desc).expect("a pipeline");
        let frame = layout::Frame { voxel_m: 1.0, scale: 1.0, ..Zeroable::zeroed() };
        let frame = upload(c, "frame", &[frame]).expect("an upload");
        let input = upload(c, "inputs", inputs).expect("an upload");
        let output = upload(c, "outputs", &vec![Arguments([[f32::MAX; 4]; 3]); inputs.len()]).expect("an upload");
        let mut binds: Vec<Bind> = self.volume.binds().collect();
        binds.push(Bind::buffer("frame", &frame));
        binds.push(Bind::buffer("inputs", &input));
        binds.push(Bind::buffer("outputs", &output));
        let mut recorder = Recorder::new(c, RecorderOptions::default()).expect("a recorder");
        let count = inputs.len() as u32;
        recorder.zone("functions", ZoneKind::Compute, 0, |r| {
            r.dispatch(&pipeline, &pipeline.select(&binds), &count, [count.div_ceil(64), 1, 1]);
        });
        recorder.finish().expect("a dispatch");
        let outputs = download(c, &output).expect("outputs");
        assert_eq!(c.take_validation_messages(), Vec::<String>::new());
        outputs
    }

    /// Traces one cone; returns its light (red), its open share, and the exponentially weighted open share.
    pub fn trace(&self, from: Vec3, d: Vec3, ratio: f32, settings: &Settings) -> [f32; 3] {
        let found =
            self.evaluate(Function::TraceCone, &[Arguments::of_vectors(from.extend(ratio), d.extend(0.0))], settings);
        [found[0].0[0][0], found[0].0[0][3], found[0].0[1][0]]
    }
}

/// The preset `photons` on a small grid, with some settings changed.
pub fn settings(changes: &[&str]) -> Settings {
    gpu::with(Settings { voxels: EDGE, ..Settings::photons() }, changes)
}
