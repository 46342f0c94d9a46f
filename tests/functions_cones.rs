//! GLSL functions of `glsl/common`, evaluated by `glsl/test/functions.comp`, against their twins.
//!
//! Both sides compute in f32 from the same formulas, so tolerances pay for rounding and for the precision that Vulkan
//! asks of sin, exp2 and log2 alone: 10⁻⁴ unless stated.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, IVec3, Mat3, Vec2, Vec3, Vec4};
use half::f16;
use scenes::Random;
use twobounce::gi::cones::constants::{Features, constants};
use twobounce::layout;
use twobounce::profile::counts::Counts;
use twobounce::settings::{ConeSet, Form, RoughnessFit, Settings, Weights};
use twobounce::twins::cone::{self, Cone};
use twobounce::twins::directions::*;
use twobounce::twins::emitters;
use twobounce::twins::mips::mip_chain;
use twobounce::twins::volume::{Level, Volume, round_to_half};
use twobounce::twins::voxelise::Polygon;
use twobounce::vk::*;

/// The numbers of `evaluate` in the shader.
#[derive(Clone, Copy)]
enum Function {
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
}

/// Three vectors in, three out.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Arguments([[f32; 4]; 3]);

impl Arguments {
    fn of(a: Vec4, b: Vec4, c: Vec4) -> Self {
        Self([a.into(), b.into(), c.into()])
    }

    fn vec4(&self, i: usize) -> Vec4 {
        Vec4::from_array(self.0[i])
    }

    fn vec3(&self, i: usize) -> Vec3 {
        self.vec4(i).truncate()
    }
}

const EDGE: u32 = 16;

/// A device with a volume to trace cones into.
struct Gpu {
    context: Arc<Context>,
    faces: Vec<Image>,
}

impl Gpu {
    fn new(volume: &Volume) -> Self {
        Self::on(gpu::context(), volume)
    }

    fn on(context: Arc<Context>, volume: &Volume) -> Self {
        let face = |k: usize| {
            let desc = ImageDesc {
                label: "face",
                dim: ImageDim::D3,
                format: Format::R16G16B16A16_SFLOAT,
                width: EDGE,
                height: EDGE,
                depth_or_layers: EDGE,
                mips: EDGE.ilog2() + 1,
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

    fn evaluate(&self, function: Function, inputs: &[Arguments], settings: &Settings) -> Vec<Arguments> {
        self.run(function, inputs, settings).0
    }

    /// Also what was counted, where the context counts.
    fn run(&self, function: Function, inputs: &[Arguments], settings: &Settings) -> (Vec<Arguments>, Counts) {
        let c = &self.context;
        let mut constants = constants(settings, Features::default(), 1);
        constants.push((20, function as u32));
        let desc = ComputeDesc { label: "functions", shader: "test/functions.comp", constants: &constants };
        let pipeline = Compute::new(c, &desc).expect("a pipeline");
        let start = &settings.start;
        let frame = layout::Frame {
            scale: 4.0,
            sky: [0.25, 0.5, 1.0],
            diffuse_start_normal: start.diffuse_normal,
            diffuse_start_along: start.diffuse_along,
            shadow_start_along: start.shadow_along,
            shadow_step: settings.shadow.step,
            cone_step: settings.step,
            cone_aperture: settings.aperture,
            exit_margin: settings.exit_margin,
            shadow_end: start.shadow_end,
            ..Zeroable::zeroed()
        };
        let frame = upload(c, "frame", &[frame]).expect("an upload");
        let input = upload(c, "inputs", inputs).expect("an upload");
        let output = upload(c, "outputs", &vec![Arguments([[f32::MAX; 4]; 3]); inputs.len()]).expect("an upload");
        let address = match settings.ledger.d11 {
            Form::Printed => SamplerAddressMode::CLAMP_TO_EDGE,
            Form::Right => SamplerAddressMode::CLAMP_TO_BORDER,
        };
        let border = BorderColor::FLOAT_TRANSPARENT_BLACK;
        let sampler = Sampler::new(c, Filter::LINEAR, SamplerMipmapMode::LINEAR, address, border).expect("a sampler");
        let names = ["volume_0", "volume_1", "volume_2", "volume_3", "volume_4", "volume_5", "volume_6"];
        let mut binds: Vec<Bind> =
            names.iter().zip(&self.faces).map(|(name, face)| Bind::image(name, face.view(), &sampler)).collect();
        binds.push(Bind::buffer("frame", &frame));
        binds.push(Bind::buffer("inputs", &input));
        binds.push(Bind::buffer("outputs", &output));
        let mut recorder = Recorder::new(c, RecorderOptions::default()).expect("a recorder");
        let count = inputs.len() as u32;
        recorder.zone("functions", ZoneKind::Compute, 0, |r| {
            r.dispatch(&pipeline, &binds, &count, [count.div_ceil(64), 1, 1]);
        });
        let timings = recorder.finish().expect("a dispatch");
        let outputs = download(c, &output).expect("outputs");
        assert_eq!(c.take_validation_messages(), Vec::<String>::new());
        (outputs, Counts::of(&timings.zones[0].counts))
    }
}

/// Random colours of random opacity, different in every target.
fn random_volume() -> Volume {
    let mut random = Random::new(5);
    let mut texel = || {
        let alpha = if random.unit() < 0.7 { 0.0 } else { random.unit() as f32 };
        round_to_half((random.point().as_vec3() * alpha).extend(alpha))
    };
    let level0: Level = std::array::from_fn(|_| (0..EDGE.pow(3)).map(|_| texel()).collect());
    mip_chain(level0, Form::Right, Form::Right)
}

/// Every choice that changes how a cone is traced, one at a time.
fn variants() -> Vec<Settings> {
    let right = Settings { voxels: EDGE, ..Settings::default() };
    let mut variants = vec![right.clone(), Settings { voxels: EDGE, ..Settings::printed() }];
    variants.extend(Weights::ALL.iter().map(|w| Settings { weights: *w, ..right.clone() }));
    variants.extend(ConeSet::ALL.iter().map(|c| Settings { cones: *c, ..right.clone() }));
    variants.extend(
        [Settings::saturating(ConeSet::G8, 1.5), Settings::saturating(ConeSet::G16, 1.0)]
            .map(|s| Settings { voxels: EDGE, ..s }),
    );
    variants.push(Settings { step: 0.5, ..right.clone() });
    let rows: [fn(&mut Settings); 9] = [
        |s| s.ledger.d6 = Form::Printed,
        |s| s.ledger.d10 = Form::Printed,
        |s| (s.ledger.d10, s.ledger.d11) = (Form::Printed, Form::Printed),
        |s| s.ledger.d12 = Form::Printed,
        |s| s.ledger.d13 = Form::Printed,
        |s| s.ledger.d15 = Form::Printed,
        |s| s.ledger.d17 = Form::Printed,
        |s| s.ledger.d18 = Form::Printed,
        |s| s.ledger.d21 = Form::Printed,
    ];
    variants.extend(rows.iter().map(|row| {
        let mut settings = right.clone();
        row(&mut settings);
        settings
    }));
    variants
}

fn close(a: Vec4, b: Vec4, tolerance: f32, what: &str) {
    assert!((a - b).abs().max_element() <= tolerance, "{what}: {a} is not {b}");
}

/// Points inside the cube and unit directions, in voxels; some along axes.
fn rays(count: usize) -> Vec<(Vec3, Vec3)> {
    let mut random = Random::new(6);
    let ray = |i: usize| {
        let direction = if i.is_multiple_of(8) { Vec3::AXES[i / 8 % 3] } else { random.direction().as_vec3() };
        (random.point().as_vec3() * EDGE as f32, direction)
    };
    (0..count).map(ray).collect()
}

#[test]
fn cones_see_what_their_twins_see() {
    let volume = random_volume();
    let gpu = Gpu::new(&volume);
    let apertures = [0.0, 0.1, 0.577, 1.0, 2.0];
    let rays = rays(400);
    for settings in variants() {
        let aperture = |i: usize| apertures[i % apertures.len()];
        let inputs: Vec<_> = (0..rays.len())
            .map(|i| Arguments::of(rays[i].0.extend(aperture(i)), rays[i].1.extend(1.5), Vec4::ZERO))
            .collect();
        for (i, out) in gpu.evaluate(Function::TraceCone, &inputs, &settings).iter().enumerate() {
            let (origin, direction) = rays[i];
            let edge = EDGE as f32;
            let cone = Cone { origin: origin / edge, direction, aperture: aperture(i), start: 1.5 / edge, end: 10.0 };
            let expected = cone::trace_cone(&volume, &cone, &settings).value;
            // Texture filtering: the driver may round a texel's weights to 8 bits, and a cone takes up to 25 samples.
            close(out.vec4(0), expected, 0.01, &format!("ray {i} of {:?} {:?}", settings.weights, settings.ledger));
        }
    }
}

#[test]
fn counted_steps_are_their_twins() {
    let volume = random_volume();
    let (plain, gpu) = (Gpu::new(&volume), Gpu::on(gpu::counting(), &volume));
    let rays = rays(400);
    let inputs: Vec<_> = rays.iter().map(|(p, d)| Arguments::of(p.extend(0.1), d.extend(1.5), Vec4::ZERO)).collect();
    for settings in variants() {
        let (outputs, counts) = gpu.run(Function::TraceCone, &inputs, &settings);
        let steps: u64 = rays
            .iter()
            .map(|&(origin, direction)| {
                let edge = EDGE as f32;
                let cone = Cone { origin: origin / edge, direction, aperture: 0.1, start: 1.5 / edge, end: 10.0 };
                u64::from(cone::trace_cone(&volume, &cone, &settings).steps)
            })
            .sum();
        // A cone whose last step lies within rounding of its end may take it or not: two cones of the 400.
        assert!(counts.cone_steps.abs_diff(steps) <= 2, "{} steps are not {steps}", counts.cone_steps);
        // Every step looks at three faces of one or two levels.
        assert!((24 * counts.cone_steps..=48 * counts.cone_steps).contains(&counts.volume_texels), "{counts:?}");
        assert_eq!(counts.shadow_steps, 0);
        // Counting changes nothing.
        for (counted, plain) in outputs.iter().zip(plain.evaluate(Function::TraceCone, &inputs, &settings)) {
            assert_eq!(counted.0.map(|v| v.map(f32::to_bits)), plain.0.map(|v| v.map(f32::to_bits)));
        }
    }
}

#[test]
fn shadow_cones_dim_as_their_twins_do() {
    let volume = random_volume();
    let gpu = Gpu::new(&volume);
    let rays = rays(200);
    for mut settings in variants() {
        settings.start.shadow_normal = 0.0;
        let to = |i: usize| {
            (rays[i].0 + rays[i].1 * 12.0 * ((i % 7) as f32 / 7.0 + 0.1)).clamp(Vec3::ZERO, Vec3::splat(EDGE as f32))
        };
        let aperture = |i: usize| [0.0, 0.0875, 0.3][i % 3];
        let inputs: Vec<_> = (0..rays.len())
            .map(|i| Arguments::of(rays[i].0.extend(aperture(i)), to(i).extend(0.0), Vec4::ZERO))
            .collect();
        for (i, out) in gpu.evaluate(Function::TraceShadowCone, &inputs, &settings).iter().enumerate() {
            let (from, to) = (rays[i].0 / EDGE as f32, to(i) / EDGE as f32);
            let expected = cone::trace_shadow_cone(&volume, from, Vec3::ZERO, to, aperture(i), 0.0, &settings);
            // As above, with up to 60 samples.
            assert!(
                (out.0[0][0] - expected).abs() < 0.01,
                "ray {i} of {:?}: {out:?} is not {expected}",
                settings.ledger
            );
        }
    }
}

#[test]
fn gathers_are_their_twins() {
    let volume = random_volume();
    let gpu = Gpu::new(&volume);
    let rays = rays(200);
    let inputs: Vec<_> = rays.iter().map(|(p, n)| Arguments::of(p.extend(0.0), n.extend(0.0), Vec4::ZERO)).collect();
    for settings in variants() {
        for (i, out) in gpu.evaluate(Function::GatherDiffuse, &inputs, &settings).iter().enumerate() {
            let (point, normal) = rays[i];
            // The printed frame jumps where |n.y| = |n.z|; rounding may take either side.
            let sky = 4.0 * Vec3::new(0.25, 0.5, 1.0);
            let expected = cone::gather_diffuse(&volume, point / EDGE as f32, normal, sky, &settings);
            // As above; the sky is as bright as 4.
            close(
                out.vec4(0),
                expected.radiance.extend(expected.open),
                0.03,
                &format!("point {i} of {:?}", settings.ledger),
            );
        }
    }
}

#[test]
fn directions_are_their_twins() {
    let gpu = Gpu::new(&random_volume());
    let directions: Vec<Vec3> = rays(300).into_iter().map(|r| r.1).collect();
    for form in [Form::Right, Form::Printed] {
        let mut settings = Settings { voxels: EDGE, ..Settings::default() };
        let ledger = &mut settings.ledger;
        (ledger.d6, ledger.d7, ledger.d8, ledger.d22, ledger.d26) = (form, form, form, form, form);

        for set in ConeSet::ALL {
            let inputs: Vec<_> =
                (0..16).map(|i| Arguments::of(Vec4::splat(i as f32), Vec4::ZERO, Vec4::ZERO)).collect();
            let out = gpu.evaluate(Function::ConeSet, &inputs, &Settings { cones: *set, ..settings.clone() });
            let cones = cone_set(*set, form, form);
            assert_eq!(out[0].0[1][1], cones.len() as f32);
            for (out, cone) in out.iter().zip(cones) {
                close(out.vec4(0), cone.direction.extend(cone.weight), 1e-5, set.name());
                assert!((out.0[1][0] - cone.aperture).abs() < 1e-5, "{set}");
            }
        }

        let inputs: Vec<_> = directions.iter().map(|d| Arguments::of(d.extend(0.3), Vec4::ZERO, Vec4::ZERO)).collect();
        let frames = gpu.evaluate(Function::TangentFrame, &inputs, &settings);
        let turns = gpu.evaluate(Function::JitterRotation, &inputs, &settings);
        for ((d, frame), turn) in directions.iter().zip(frames).zip(turns) {
            let columns = |a: Arguments| Mat3::from_cols(a.vec3(0), a.vec3(1), a.vec3(2));
            assert!(columns(frame).abs_diff_eq(tangent_frame(*d, form), 1e-3), "frame of {d}: {frame:?}");
            let expected = rotation(*d, jitter_angle(0.3, form), form);
            assert!(columns(turn).abs_diff_eq(expected, 1e-3), "turn about {d}: {turn:?} is not {expected}");
        }
    }
    for weights in Weights::ALL {
        let settings = Settings { voxels: EDGE, weights: *weights, ..Settings::default() };
        let origin = Vec3::new(3.0, 5.0, 7.0);
        let inputs: Vec<_> =
            directions.iter().map(|d| Arguments::of(d.extend(0.0), origin.extend(0.0), Vec4::ZERO)).collect();
        for (d, out) in directions.iter().zip(gpu.evaluate(Function::WeightsAndExit, &inputs, &settings)) {
            if *weights != Weights::Extinction {
                close(out.vec3(0).extend(0.0), cone::direction_weights(*d, *weights).extend(0.0), 1e-5, weights.name());
            }
            let exit = cone::exit_distance(origin / EDGE as f32, *d) * EDGE as f32;
            assert!((out.0[0][3] - exit).abs() < 1e-4 * exit, "{d}: {} is not {exit}", out.0[0][3]);
        }
    }
}

#[test]
fn roughness_fits_are_their_twins() {
    let gpu = Gpu::new(&random_volume());
    for fit in RoughnessFit::ALL {
        let settings = Settings { voxels: EDGE, roughness_fit: *fit, ..Settings::default() };
        let inputs: Vec<_> =
            (0..=100).map(|i| Arguments::of(Vec4::splat(i as f32 / 100.0), Vec4::ZERO, Vec4::ZERO)).collect();
        for (x, out) in inputs.iter().zip(gpu.evaluate(Function::RoughnessToAperture, &inputs, &settings)) {
            let expected = roughness_to_aperture(x.0[0][0], *fit);
            // acos of a number near 1 loses half the digits, and pow is exp2 of log2.
            assert!((out.0[0][0] - expected).abs() < 3e-3 + 1e-3 * expected, "{fit} {x:?}: {out:?} is not {expected}");
        }
    }
}

/// The angle that holds half of GGX's lobe, seen along the normal: visible normals by their closed form, Smith's G1.
fn half_of_the_lobe(alpha: f64) -> f64 {
    const COUNT: usize = 20_000;
    let parts: Vec<(f64, f64)> = (0..COUNT)
        .map(|i| {
            let xi = (i as f64 + 0.5) / COUNT as f64;
            let angle = 2.0 * (alpha * (xi / (1.0 - xi)).sqrt()).atan();
            let c = angle.cos().max(0.0);
            (angle, 2.0 * c / (c + (alpha * alpha + (1.0 - alpha * alpha) * c * c).sqrt()))
        })
        .collect();
    let mut left = parts.iter().map(|p| p.1).sum::<f64>() / 2.0;
    let half = parts.iter().find(|p| {
        left -= p.1;
        left <= 0.0
    });
    half.expect("half of them is among them").0
}

#[test]
fn the_ggx_fit_is_as_wide_as_the_lobe() {
    for i in 1..=50 {
        let roughness = f64::from(i) / 50.0;
        // A Gaussian of standard deviation a, tangents over distance, has half of it within √(2 ln 2) a.
        let expected = half_of_the_lobe(roughness * roughness).tan() / (2.0 * 2f64.ln()).sqrt();
        let fit = f64::from(roughness_to_aperture(roughness as f32, RoughnessFit::Ggx));
        // The fit's own residual.
        assert!((fit / expected - 1.0).abs() < 0.022, "roughness {roughness}: {fit} is not {expected}");
    }
}

#[test]
fn visible_normals_are_their_twins() {
    let gpu = Gpu::new(&random_volume());
    let settings = Settings { voxels: EDGE, ..Settings::default() };
    let mut random = Random::new(10);
    let cases: Vec<(Vec3, f32, Vec2)> = (0..600)
        .map(|i| {
            let v = if i % 3 == 0 { Vec3::Z } else { random.direction().as_vec3() };
            let alpha = [0.001, 0.04, 0.25, 1.0][i % 4];
            (v.with_z(v.z.abs().max(1e-3)).normalize(), alpha, Vec2::new(random.unit() as f32, random.unit() as f32))
        })
        .collect();
    let inputs: Vec<_> = cases
        .iter()
        .map(|(v, alpha, u)| Arguments::of(v.extend(*alpha), u.extend(0.0).extend(0.0), Vec4::ZERO))
        .collect();
    for ((v, alpha, u), out) in cases.iter().zip(gpu.evaluate(Function::VisibleNormal, &inputs, &settings)) {
        close(out.vec3(0).extend(0.0), visible_normal(*alpha, *v, *u).extend(0.0), 1e-3, &format!("{v} {alpha} {u}"));
        assert!(out.vec3(0).dot(*v) > -1e-4, "{v} does not see {out:?}");
        if *v == Vec3::Z && u.y < 0.99 {
            // The closed form: tan²θ = α²ξ/(1 − ξ). f32's rounding of 1 − ξ is what grows with 1/(1 − ξ).
            let tangent = out.vec3(0).truncate().length() / out.0[0][2];
            let expected = alpha * (u.y / (1.0 - u.y)).sqrt();
            assert!((tangent - expected).abs() < 2e-3 * (1.0 + expected), "{alpha} {u}: {tangent} is not {expected}");
        }
    }
}

#[test]
fn refraction_is_its_twin_and_never_nan() {
    let gpu = Gpu::new(&random_volume());
    let settings = Settings { voxels: EDGE, ..Settings::default() };
    let mut random = Random::new(7);
    let cases: Vec<(Vec3, Vec3, f32)> = (0..600)
        .map(|i| (random.direction().as_vec3(), random.direction().as_vec3(), [1.0, 1.33, 1.5][i % 3]))
        .collect();
    let inputs: Vec<_> = cases
        .iter()
        .map(|&(incident, normal, ior)| {
            let back = incident.dot(normal) > 0.0;
            let met = if back { -normal } else { normal };
            Arguments::of(incident.extend(ior), met.extend(f32::from(u8::from(back))), Vec4::ZERO)
        })
        .collect();
    for ((incident, normal, ior), out) in
        cases.iter().zip(gpu.evaluate(Function::RefractionDirection, &inputs, &settings))
    {
        let expected = refraction_direction(*incident, *normal, *ior, Form::Right);
        // Near the critical angle the refracted direction goes with the square root of f32's rounding.
        assert!((out.vec3(0) - expected).length() < 1e-3, "{incident} {normal} {ior}: {out:?} is not {expected}");
    }
}

#[test]
fn clipping_is_exact_where_it_matters() {
    let gpu = Gpu::new(&random_volume());
    let settings = Settings { voxels: EDGE, ..Settings::default() };
    let mut random = Random::new(8);
    let mut triangles = Vec::new();
    for i in 0..2000 {
        let size = [0.1, 1.0, 8.0][i % 3];
        let mut corner = || (DVec3::splat(7.5) + (random.point() - 0.5) * size).as_vec3();
        triangles.push([corner(), corner(), corner()]);
    }
    let center = 7.5f32;
    let inputs: Vec<_> = triangles
        .iter()
        .map(|t| Arguments::of(t[0].extend(center), t[1].extend(center), t[2].extend(center)))
        .collect();
    let mut touched = 0;
    for (t, out) in triangles.iter().zip(gpu.evaluate(Function::ClipToVoxel, &inputs, &settings)) {
        let clip = |by: f64| Polygon::clipped(&t.map(|p| p.as_dvec3()), DVec3::splat(7.0 - by), DVec3::splat(8.0 + by));
        let (polygon, grown, shrunk) = (clip(0.0), clip(1e-4), clip(-1e-4));
        let touches = out.0[1][0] == 1.0;
        assert!(touches || shrunk.corners.is_empty(), "{t:?} is missed");
        assert!(!touches || !grown.corners.is_empty(), "{t:?} is no neighbour");
        touched += usize::from(touches);
        // Corners of f32 near 16 are off by 10⁻⁶ of a voxel, times a side of at most √2, for up to nine of them.
        let area = polygon.area_vector().length();
        assert!((f64::from(out.0[0][3]) - area).abs() < 2e-5, "{t:?}: {out:?} is not {area}");
        if area > 1e-3 {
            assert!((out.vec3(0).as_dvec3() - polygon.centroid()).length() < 1e-3, "{t:?}: {out:?}");
        }
    }
    assert!((1000..2000).contains(&touched), "{touched}");
}

#[test]
fn fixed_sums_know_no_order_and_lose_nothing_that_counts() {
    let gpu = Gpu::new(&random_volume());
    let settings = Settings { voxels: EDGE, ..Settings::default() };
    let mut random = Random::new(9);
    // From 2⁻²⁴, the smallest half, to 2¹⁵.
    let mut term = || Vec4::from_array(std::array::from_fn(|_| (random.unit() * 39.0 - 24.0).exp2() as f32));
    let terms: Vec<[Vec4; 3]> = (0..500).map(|_| [term(), term(), term()]).collect();
    let ordered = |order: [usize; 3]| {
        let inputs: Vec<_> = terms.iter().map(|t| Arguments::of(t[order[0]], t[order[1]], t[order[2]])).collect();
        gpu.evaluate(Function::FixedSum, &inputs, &settings)
    };
    let sums = ordered([0, 1, 2]);
    for (a, b) in sums.iter().zip(ordered([2, 0, 1])) {
        assert_eq!(a.0, b.0);
    }
    for (t, sum) in terms.iter().zip(sums) {
        for i in 0..4 {
            let exact: f64 = t.iter().map(|v| f64::from(v[i])).sum();
            // Three truncations to 2⁻³², and f32's own rounding.
            assert!((f64::from(sum.0[0][i]) - exact).abs() < 3.0 / 4_294_967_296.0 + exact * 1e-7, "{t:?} {sum:?}");
        }
    }
}

#[test]
fn a_triangle_lights_as_much_as_its_points_do() {
    let mut random = scenes::Random::new(11);
    let triangles: Vec<([DVec3; 3], DVec3)> = (0..300)
        .map(|i| {
            // From a hundredth of the distance to many times it, above, below and across the horizon.
            let size = 10f64.powf(-2.0 + 3.0 * f64::from(i) / 300.0);
            let center = random.direction();
            (std::array::from_fn(|_| center + random.direction() * size), random.direction())
        })
        .collect();
    let input = |([a, b, c], n): &([DVec3; 3], DVec3)| {
        let with = |p: &DVec3, w: f64| p.as_vec3().extend(w as f32);
        Arguments::of(with(a, n.x), with(b, n.y), with(c, n.z))
    };
    let inputs: Vec<Arguments> = triangles.iter().map(input).collect();
    let found = Gpu::new(&random_volume()).evaluate(Function::TriangleIrradiance, &inputs, &Settings::default());
    let mut crossing = 0;
    for ((triangle, normal), out) in triangles.iter().zip(found) {
        let expected = emitters::triangle_irradiance(triangle, *normal);
        let found = f64::from(out.vec4(0).x);
        let above = triangle.iter().filter(|p| p.dot(*normal) > 0.0).count();
        crossing += u32::from(above == 1 || above == 2);
        // f32, whose rounding grows with the size; 10⁻⁶ is the smallest that matters beside a hemisphere's π.
        let tolerance = 2e-3 * expected.abs() + 1e-5;
        assert!((found - expected).abs() < tolerance, "{triangle:?}, {normal}: {found} is not {expected}");
    }
    assert!(crossing > 50, "{crossing} triangles cross the horizon");
}

#[test]
fn neighbours_in_a_square_share_all_directions() {
    for interleave in [2, 4] {
        let settings = Settings { interleave, ..Settings::default() };
        let side = interleave as i32;
        // Any square of pixels, and of voxels in each of the three planes.
        let planes = [[IVec3::X, IVec3::Y], [IVec3::Y, IVec3::Z], [IVec3::Z, IVec3::X]];
        for ([u, v], corner) in planes.into_iter().zip([IVec3::new(3, 5, 0), IVec3::new(7, 1, 2), IVec3::new(0, 9, 6)])
        {
            let at = |i: i32| (corner + u * (i % side) + v * (i / side)).as_vec3().extend(0.0);
            let inputs: Vec<Arguments> =
                (0..side * side).map(|i| Arguments::of(at(i), Vec4::ZERO, Vec4::ZERO)).collect();
            let found = Gpu::new(&random_volume()).evaluate(Function::InterleavedShift, &inputs, &settings);
            let mut seen: Vec<Vec2> = found.iter().map(|out| out.vec4(0).truncate().truncate()).collect();
            seen.sort_by(|a, b| a.x.total_cmp(&b.x));
            let expected = interleaved_shifts(interleave);
            for (a, b) in seen.iter().zip(&expected) {
                // One rounding of f32.
                assert!((*a - *b).abs().max_element() < 1e-6, "{interleave}: {seen:?} is not {expected:?}");
            }
        }
    }
}
