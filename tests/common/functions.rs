//! GLSL functions of `glsl`, evaluated by `glsl/test/functions.comp`. Every test file uses a part of this.
//!
//! Both sides compute in f32 from the same formulas, so tolerances cover rounding and the precision that Vulkan
//! requires of sin, exp2 and log2 alone: 10⁻⁴ unless stated.
#![allow(dead_code)]

use std::sync::Arc;

use crate::gpu::twins::mips::mip_chain;
use crate::gpu::twins::volume::{Level, Volume, round_to_half};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use half::f16;
use twobounce::gi::cones::choices::Form;
use twobounce::gi::cones::constants::{Cones, constants as of_cones};
use twobounce::ground::constants::{Features, constants, with};
use twobounce::ground::layout;
use twobounce::profile::counts::Counts;
use twobounce::settings::Settings;
use twobounce::vk::*;

use crate::gpu;
use crate::scenes::Random;

/// The number of each function in the shader's `evaluate`.
#[derive(Clone, Copy)]
pub enum Function {
    ConeSet,
    TangentFrame,
    JitterRotation,
    RoughnessToAperture,
    WeightsAndExit,
    RefractionDirection,
    ClipToVoxel,
    FixedSum,
    TraceCone,
    TraceShadowCone,
    GatherDiffuse,
    TriangleIrradiance,
    InterleavedShift,
    VisibleNormal,
    DiffuseShare,
    MethodShadow,
    ItemLobe,
    SpecularAlbedo,
}

/// Three vectors in, three out.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Arguments(pub [[f32; 4]; 3]);

impl Arguments {
    pub fn of_vectors(a: Vec4, b: Vec4, c: Vec4) -> Self {
        Self([a.into(), b.into(), c.into()])
    }

    pub fn vec4(&self, i: usize) -> Vec4 {
        Vec4::from_array(self.0[i])
    }

    pub fn vec3(&self, i: usize) -> Vec3 {
        self.vec4(i).truncate()
    }
}

pub const EDGE: u32 = 16;

/// A device with a volume that cones are traced through.
pub struct Gpu {
    context: Arc<Context>,
    faces: Vec<Image>,
}

impl Gpu {
    pub fn new(volume: &Volume) -> Self {
        Self::on(gpu::context(), volume)
    }

    pub fn on(context: Arc<Context>, volume: &Volume) -> Self {
        let edge = volume.edge();
        let face = |k: usize| {
            let desc = ImageDesc {
                label: "face",
                dim: ImageDim::D3,
                format: Format::R16G16B16A16_SFLOAT,
                width: edge,
                height: edge,
                depth_or_layers: edge,
                mips: edge.ilog2() + 1,
                samples: 1,
                usage: ImageUsageFlags::SAMPLED | ImageUsageFlags::TRANSFER_DST,
                ..Default::default()
            };
            let image = Image::new(&context, &desc).expect("an image");
            for (i, level) in volume.levels().iter().enumerate() {
                let texels: Vec<[u16; 4]> =
                    level[k].iter().map(|t| t.to_array().map(|x| f16::from_f32(x).to_bits())).collect();
                upload_image(&context, &image, ImageRegion::level(&image, i as u32), &texels).expect("an upload");
            }
            image
        };
        let faces = (0..7).map(face).collect();
        Self { context, faces }
    }

    pub fn evaluate(&self, function: Function, inputs: &[Arguments], settings: &Settings) -> Vec<Arguments> {
        self.run(function, inputs, settings).0
    }

    /// Each case with the results of its arguments, on a grid of [`EDGE`].
    pub fn results<'a, T>(
        &self,
        function: Function,
        cases: &'a [T],
        arguments: impl Fn(&T) -> Arguments,
    ) -> Vec<(&'a T, Arguments)> {
        let inputs: Vec<_> = cases.iter().map(arguments).collect();
        cases.iter().zip(self.evaluate(function, &inputs, &settings())).collect()
    }

    /// As [`Self::run`], with the counters, where the context counts.
    pub fn run(&self, function: Function, inputs: &[Arguments], settings: &Settings) -> (Vec<Arguments>, Counts) {
        let c = &self.context;
        let mut constants = with(constants(settings, Features::default()), &of_cones(&settings.of.cones));
        constants.push(("FUNCTION", (function as u32).into()));
        let desc = ComputeDesc { label: "functions", shader: "test/functions.comp", constants: &constants };
        let pipeline = Compute::new(c, &desc).expect("a pipeline");
        let frame = layout::Frame { scale: 4.0, sky: [0.25, 0.5, 1.0], ..Zeroable::zeroed() };
        let cones = upload(c, "cones", &[Cones::new(&settings.of.cones, settings.voxels)]).expect("an upload");
        let frame = upload(c, "frame", &[frame]).expect("an upload");
        let input = upload(c, "inputs", inputs).expect("an upload");
        let output = upload(c, "outputs", &vec![Arguments([[f32::MAX; 4]; 3]); inputs.len()]).expect("an upload");
        let sampler = Sampler::new(c, Filter::LINEAR, settings.of.cones.address_mode()).expect("a sampler");
        let names = ["volume_0", "volume_1", "volume_2", "volume_3", "volume_4", "volume_5", "volume_6"];
        let mut binds: Vec<Bind> =
            names.iter().zip(&self.faces).map(|(name, face)| Bind::image(name, face.view(), &sampler)).collect();
        binds.push(Bind::buffer("frame", &frame));
        binds.push(Bind::buffer("cones", &cones));
        binds.push(Bind::buffer("inputs", &input));
        binds.push(Bind::buffer("outputs", &output));
        let mut recorder = Recorder::new(c, RecorderOptions::default()).expect("a recorder");
        let count = inputs.len() as u32;
        recorder.zone("functions", ZoneKind::Compute, 0, |r| {
            r.dispatch(&pipeline, &pipeline.select(&binds), &count, [count.div_ceil(64), 1, 1]);
        });
        let timings = recorder.finish().expect("a dispatch");
        let outputs = download(c, &output).expect("outputs");
        assert_eq!(c.take_validation_messages(), Vec::<String>::new());
        (outputs, Counts::of_counters(&timings.zones[0].counts))
    }
}

pub fn settings() -> Settings {
    Settings { voxels: EDGE, ..Settings::corrected() }
}

/// Random colours of random opacity, different in every target.
pub fn random_volume() -> Volume {
    let mut random = Random::new(5);
    let mut texel = || {
        let alpha = if random.unit() < 0.7 { 0.0 } else { random.unit() as f32 };
        round_to_half((random.point().as_vec3() * alpha).extend(alpha))
    };
    let level0: Level = std::array::from_fn(|_| (0..EDGE.pow(3)).map(|_| texel()).collect());
    mip_chain(level0, Form::Right, Form::Right)
}

pub fn close(a: Vec4, b: Vec4, tolerance: f32, what: &str) {
    assert!((a - b).abs().max_element() <= tolerance, "{what}: {a} is not {b}");
}

/// Points inside the cube and unit directions, in voxels; some along axes.
pub fn rays(count: usize) -> Vec<(Vec3, Vec3)> {
    let mut random = Random::new(6);
    let ray = |i: usize| {
        let direction = if i.is_multiple_of(8) { Vec3::AXES[i / 8 % 3] } else { random.direction().as_vec3() };
        (random.point().as_vec3() * EDGE as f32, direction)
    };
    (0..count).map(ray).collect()
}
