//! Cones, and the map from roughness to their width: GLSL functions of `glsl/gi/cones` against their twins.

use crate::gpu;

use crate::functions::{Arguments, EDGE, Function, Gpu, close, random_volume, rays, settings};
use glam::{Vec3, Vec4};
use gpu::twins::cone::{self, Cone};
use gpu::twins::directions::roughness_to_aperture;
use gpu::twins::volume::{Level, Volume};
use std::f32::consts::FRAC_1_SQRT_2;
use twobounce::gi::cones::choices::{ConeSet, Form, RoughnessFit, Weights};
use twobounce::settings::Settings;

/// Every setting that changes the tracing of a cone, one at a time.
fn variants() -> Vec<Settings> {
    let right = settings();
    let mut variants = vec![right.clone(), Settings { voxels: EDGE, ..Settings::printed() }];
    let change = |key: &str, value: &str| gpu::with(right.clone(), &[&format!("{key}={value}")]);
    variants.extend(Weights::ALL.iter().map(|w| change("cones.weights", w.name())));
    variants.extend(ConeSet::ALL.iter().map(|c| change("cones.set", c.name())));
    let saturating = |set, step| gpu::with(Settings { voxels: EDGE, ..Settings::cones() }, &[set, step]);
    variants.push(saturating("cones.set=g8", "cones.step=1.5"));
    variants.push(saturating("cones.set=g16", "cones.step=1"));
    variants.push(change("cones.step", "0.5"));
    variants.push(gpu::with(variants[1].clone(), &["cones.wrap=repeat"]));
    let rows: [fn(&mut Settings); 9] = [
        |s| s.of.cones.ledger.d6 = Form::Printed,
        |s| s.of.cones.ledger.d10 = Form::Printed,
        |s| (s.of.cones.ledger.d10, s.of.cones.ledger.d11) = (Form::Printed, Form::Printed),
        |s| s.of.cones.ledger.d12 = Form::Printed,
        |s| s.of.cones.ledger.d13 = Form::Printed,
        |s| s.of.cones.ledger.d15 = Form::Printed,
        |s| s.of.cones.ledger.d17 = Form::Printed,
        |s| s.of.cones.ledger.d18 = Form::Printed,
        |s| s.of.cones.ledger.d21 = Form::Printed,
    ];
    variants.extend(rows.iter().map(|row| {
        let mut settings = right.clone();
        row(&mut settings);
        settings
    }));
    variants
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
            .map(|i| Arguments::of_vectors(rays[i].0.extend(aperture(i)), rays[i].1.extend(1.5), Vec4::ZERO))
            .collect();
        for (i, out) in gpu.evaluate(Function::TraceCone, &inputs, &settings).iter().enumerate() {
            let (origin, direction) = rays[i];
            let edge = EDGE as f32;
            let cone = Cone { origin: origin / edge, direction, aperture: aperture(i), start: 1.5 / edge, end: 10.0 };
            let expected = cone::trace_cone(&volume, &cone, &settings.of.cones).value;
            // Texture filtering: the driver may round a texel's weights to 8 bits, and a cone takes up to 25 samples.
            close(
                out.vec4(0),
                expected,
                0.01,
                &format!("ray {i} of {:?} {:?}", settings.of.cones.weights, settings.of.cones.ledger),
            );
        }
    }
}

#[test]
fn counted_steps_are_their_twins() {
    let volume = random_volume();
    let (plain, gpu) = (Gpu::new(&volume), Gpu::on(gpu::counting(), &volume));
    let rays = rays(400);
    let inputs: Vec<_> =
        rays.iter().map(|(p, d)| Arguments::of_vectors(p.extend(0.1), d.extend(1.5), Vec4::ZERO)).collect();
    for settings in variants() {
        let (outputs, counts) = gpu.run(Function::TraceCone, &inputs, &settings);
        let steps: u64 = rays
            .iter()
            .map(|&(origin, direction)| {
                let edge = EDGE as f32;
                let cone = Cone { origin: origin / edge, direction, aperture: 0.1, start: 1.5 / edge, end: 10.0 };
                cone::trace_cone(&volume, &cone, &settings.of.cones).look_ups.len() as u64
            })
            .sum();
        // Where a cone's last step lies within rounding of its end, either result is right: two cones of the 400.
        assert!(counts.cone_steps.abs_diff(steps) <= 2, "{} steps are not {steps}", counts.cone_steps);
        // Every step reads three faces of one or two levels.
        assert!((24 * counts.cone_steps..=48 * counts.cone_steps).contains(&counts.volume_texels), "{counts:?}");
        assert_eq!(counts.shadow_steps, 0);
        // Counting changes no result.
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
        settings.of.cones.start.shadow_normal = 0.0;
        let to = |i: usize| {
            (rays[i].0 + rays[i].1 * 12.0 * ((i % 7) as f32 / 7.0 + 0.1)).clamp(Vec3::ZERO, Vec3::splat(EDGE as f32))
        };
        let aperture = |i: usize| [0.0, 0.0875, 0.3][i % 3];
        let inputs: Vec<_> = (0..rays.len())
            .map(|i| Arguments::of_vectors(rays[i].0.extend(aperture(i)), to(i).extend(0.0), Vec4::ZERO))
            .collect();
        for (i, out) in gpu.evaluate(Function::TraceShadowCone, &inputs, &settings).iter().enumerate() {
            let (from, to) = (rays[i].0 / EDGE as f32, to(i) / EDGE as f32);
            let expected = cone::trace_shadow_cone(&volume, from, Vec3::ZERO, to, aperture(i), 0.0, &settings.of.cones);
            // As above, with up to 60 samples.
            assert!(
                (out.0[0][0] - expected).abs() < 0.01,
                "ray {i} of {:?}: {out:?} is not {expected}",
                settings.of.cones.ledger
            );
        }
    }
}

/// PCG, by Jarzynski and Olano, as `glsl/common/jitter.glsl` has it.
fn jitter(seed: [u32; 4]) -> f32 {
    let mut s = seed.map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for (a, b, c) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
        s[a] = s[a].wrapping_add(s[b].wrapping_mul(s[c]));
    }
    let s = s.map(|v| v ^ v >> 16);
    (s[0].wrapping_add(s[1].wrapping_mul(s[3])) >> 8) as f32 / 16_777_216.0
}

#[test]
fn printed_shadow_cones_start_at_random_shares_of_a_step() {
    let volume = random_volume();
    let gpu = Gpu::new(&volume);
    // Far enough inside that a start off the surface is inside, too.
    let (rays, edge): (Vec<_>, _) = (rays(200).iter().map(|(p, n)| (0.5 * *p + 4.0, *n)).collect(), EDGE as f32);
    for settings in [Settings::printed(), Settings::corrected()] {
        let settings = Settings { voxels: EDGE, ..settings };
        let own = &settings.of.cones;
        let to = |i: usize| rays[(i + 1) % rays.len()].0;
        let input = |i: usize| Arguments::of_vectors(rays[i].0.extend(0.0), to(i).extend(0.0), rays[i].1.extend(0.0));
        let inputs: Vec<_> = (0..rays.len()).map(input).collect();
        let (mut moved, mut mean) = (0, 0.0);
        for (i, out) in gpu.evaluate(Function::MethodShadow, &inputs, &settings).iter().enumerate() {
            let (from, normal) = rays[i];
            let [x, y, z] = std::array::from_fn(|k| from[k].to_bits() ^ normal[k].to_bits() ^ to(i)[k].to_bits());
            let share = jitter([x, y, z, 0]);
            let twin = |share| {
                let aperture = 5f32.to_radians().tan();
                cone::trace_shadow_cone(&volume, from / edge, normal, to(i) / edge, aperture, share, own)
            };
            // As above.
            assert!((out.0[0][0] - twin(share)).abs() < 0.01, "ray {i}: {out:?} is not {}", twin(share));
            moved += usize::from((twin(0.0) - twin(share)).abs() > 0.02);
            mean += share / rays.len() as f32;
        }
        assert!(moved > 30, "{moved} of 200 are a test of little");
        assert!((mean - 0.5).abs() < 0.06, "{mean}");
    }
}

#[test]
fn gathers_are_their_twins() {
    let volume = random_volume();
    let gpu = Gpu::new(&volume);
    let rays = rays(200);
    let inputs: Vec<_> =
        rays.iter().map(|(p, n)| Arguments::of_vectors(p.extend(0.0), n.extend(0.0), Vec4::ZERO)).collect();
    for settings in variants() {
        for (i, out) in gpu.evaluate(Function::GatherDiffuse, &inputs, &settings).iter().enumerate() {
            let (point, normal) = rays[i];
            // The printed frame jumps where |n.y| = |n.z|; rounding may take either side.
            let sky = 4.0 * Vec3::new(0.25, 0.5, 1.0);
            let expected = cone::gather_diffuse(&volume, point / EDGE as f32, normal, sky, &settings.of.cones);
            // As above; the sky has a radiance of 4.
            close(
                out.vec4(0),
                expected.radiance.extend(expected.open),
                0.03,
                &format!("point {i} of {:?}", settings.of.cones.ledger),
            );
        }
    }
}

#[test]
fn the_offset_moves_the_look_ups_and_not_their_width() {
    // Every level's texels hold the number of their level and the fact that they were read; level 3's also their
    // height.
    let level = |l: u32| -> Level {
        let edge = 128 >> l;
        let height = |i: u32| if l == 3 { (8 * (i / edge % edge) + 4) as f32 } else { 0.0 };
        let texels: Vec<_> = (0..edge.pow(3)).map(|i| Vec4::new(l as f32, 1.0, height(i), 0.0)).collect();
        std::array::from_fn(|_| texels.clone())
    };
    let volume = Volume::new((0..=7).map(level).collect());
    let settings = Settings { voxels: 128, ..Settings::printed() };
    let input = Arguments::of_vectors(Vec4::new(64.0, 40.0, 64.0, 0.0), Vec4::Y, Vec4::ZERO);
    let gpu = Gpu::new(&volume).evaluate(Function::GatherDiffuse, &[input], &settings)[0].vec3(0);
    let twin =
        cone::gather_diffuse(&volume, Vec3::new(0.5, 40.0 / 128.0, 0.5), Vec3::Y, Vec3::ZERO, &settings.of.cones);
    // By hand: diameters of 8, 24, 72 and 216 voxels, of which 128 is the chain's last level; 1 + 4/√2 voxels up, and
    // from there 2.72 along a cone that is vertical or inclined by 45°.
    let levels = 3.0 + 24f32.log2() + 72f32.log2() + 7.0;
    let height = 40.0 + 1.0 + 4.0 * FRAC_1_SQRT_2 + 2.72 * (0.28 + 0.72 * FRAC_1_SQRT_2);
    // A driver may round the share of a level to 8 bits.
    close(gpu.extend(0.0), Vec4::new(levels, 4.0, height, 0.0), 0.01, "the shader's sum");
    close(twin.radiance.extend(0.0), Vec4::new(levels, 4.0, height, 0.0), 1e-3, "the twin's sum");
}

#[test]
fn roughness_fits_are_their_twins() {
    let gpu = Gpu::new(&random_volume());
    for fit in RoughnessFit::ALL {
        let settings = gpu::with(settings(), &[&format!("cones.roughness_fit={fit}")]);
        let inputs: Vec<_> =
            (0..=100).map(|i| Arguments::of_vectors(Vec4::splat(i as f32 / 100.0), Vec4::ZERO, Vec4::ZERO)).collect();
        for (x, out) in inputs.iter().zip(gpu.evaluate(Function::RoughnessToAperture, &inputs, &settings)) {
            let expected = roughness_to_aperture(x.0[0][0], *fit);
            // acos of a number near 1 loses half the digits, and pow is exp2 of log2.
            assert!((out.0[0][0] - expected).abs() < 3e-3 + 1e-3 * expected, "{fit} {x:?}: {out:?} is not {expected}");
        }
    }
}

/// The angle that holds half of GGX's lobe for a view along the normal: visible normals by their closed form, Smith's
/// G1.
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
        // A Gaussian of standard deviation a, in tangents, has half of its weight within √(2 ln 2) a.
        let expected = half_of_the_lobe(roughness * roughness).tan() / (2.0 * 2f64.ln()).sqrt();
        let fit = f64::from(roughness_to_aperture(roughness as f32, RoughnessFit::Ggx));
        // The fit's own residual.
        assert!((fit / expected - 1.0).abs() < 0.022, "roughness {roughness}: {fit} is not {expected}");
    }
}
