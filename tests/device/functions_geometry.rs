//! Directions, clipped and lit triangles, and their packed sums: GLSL functions of `glsl/common` against their twins.

use crate::gpu;

use crate::functions::{Arguments, EDGE, Function, Gpu, close, random_volume, rays, settings};
use crate::scenes::Random;
use glam::{DVec3, IVec3, Mat3, Vec2, Vec3, Vec4};
use gpu::twins::directions::*;
use gpu::twins::voxelise::Polygon;
use gpu::twins::{cone, lamps};
use twobounce::gi::cones::choices::{ConeSet, Form, Weights};
use twobounce::settings::Settings;

#[test]
fn directions_are_their_twins() {
    let gpu = Gpu::new(&random_volume());
    let directions: Vec<Vec3> = rays(300).into_iter().map(|r| r.1).collect();
    for form in [Form::Right, Form::Printed] {
        let mut settings = settings();
        let ledger = &mut settings.of.cones.ledger;
        (ledger.d6, ledger.d7, ledger.d8, ledger.d22, ledger.d26) = (form, form, form, form, form);

        for set in ConeSet::ALL {
            let inputs: Vec<_> =
                (0..16).map(|i| Arguments::of_vectors(Vec4::splat(i as f32), Vec4::ZERO, Vec4::ZERO)).collect();
            let out =
                gpu.evaluate(Function::ConeSet, &inputs, &gpu::with(settings.clone(), &[&format!("cones.set={set}")]));
            let cones = cone_set(*set, form, form);
            assert_eq!(out[0].0[1][1], cones.len() as f32);
            for (out, cone) in out.iter().zip(cones) {
                close(out.vec4(0), cone.direction.extend(cone.weight), 1e-5, set.name());
                assert!((out.0[1][0] - cone.aperture).abs() < 1e-5, "{set}");
            }
        }

        let inputs: Vec<_> =
            directions.iter().map(|d| Arguments::of_vectors(d.extend(0.3), Vec4::ZERO, Vec4::ZERO)).collect();
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
        let settings = gpu::with(settings(), &[&format!("cones.weights={weights}")]);
        let origin = Vec3::new(3.0, 5.0, 7.0);
        let inputs: Vec<_> =
            directions.iter().map(|d| Arguments::of_vectors(d.extend(0.0), origin.extend(0.0), Vec4::ZERO)).collect();
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
fn visible_normals_are_their_twins() {
    let mut random = Random::new(10);
    let cases: Vec<(Vec3, f32, Vec2)> = (0..600)
        .map(|i| {
            let v = if i % 3 == 0 { Vec3::Z } else { random.direction().as_vec3() };
            let alpha = [0.001, 0.04, 0.25, 1.0][i % 4];
            (v.with_z(v.z.abs().max(1e-3)).normalize(), alpha, Vec2::new(random.unit() as f32, random.unit() as f32))
        })
        .collect();
    let arguments = |(v, alpha, u): &(Vec3, f32, Vec2)| {
        Arguments::of_vectors(v.extend(*alpha), u.extend(0.0).extend(0.0), Vec4::ZERO)
    };
    for ((v, alpha, u), out) in Gpu::new(&random_volume()).results(Function::VisibleNormal, &cases, arguments) {
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

/// Radiance that a GGX lobe with separable Smith masking reflects of a uniform radiance of 1 towards a direction with
/// that cosine: by half vectors that are distributed as its microfacets are.
fn mirrored_of_even_light(f0: f64, f90: f64, alpha: f64, cosine: f64) -> f64 {
    const SIDE: u32 = 160;
    let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let masking = |z: f64| 2.0 * z / (z + (alpha * alpha + (1.0 - alpha * alpha) * z * z).sqrt());
    let mut sum = 0.0;
    for i in 0..SIDE * SIDE {
        let [u, v] = [i / SIDE, i % SIDE].map(|i| (f64::from(i) + 0.5) / f64::from(SIDE));
        let tangent2 = alpha * alpha * u / (1.0 - u);
        let (z, turn) = ((1.0 / (1.0 + tangent2)).sqrt(), std::f64::consts::TAU * v);
        let h = DVec3::new(turn.cos() * (1.0 - z * z).sqrt(), turn.sin() * (1.0 - z * z).sqrt(), z);
        let along = view.dot(h);
        let l = 2.0 * along * h - view;
        if along > 0.0 && l.z > 0.0 {
            let fresnel = f0 + (f90 - f0) * (1.0 - along).powi(5);
            sum += fresnel * masking(l.z) * masking(cosine) * along / (cosine * z);
        }
    }
    sum / f64::from(SIDE * SIDE)
}

#[test]
fn specular_albedo_is_the_share_of_even_light_that_is_mirrored() {
    let cases: Vec<(f32, f32, f32)> = [0.04, 0.5, 1.0]
        .into_iter()
        .flat_map(|f0| (1..=10).map(move |r| (f0, 0.1 * r as f32)))
        .flat_map(|(f0, r)| (0..10).map(move |c| (f0, r, 0.05 + 0.1 * c as f32)))
        .collect();
    let arguments = |&(f0, r, cosine): &(f32, f32, f32)| {
        Arguments::of_vectors(Vec3::splat(f0).extend(1.0), Vec4::new(r, cosine, 0.0, 0.0), Vec4::ZERO)
    };
    let (mut squares, mut weights) = (0.0, 0.0);
    for ((f0, r, cosine), out) in Gpu::new(&random_volume()).results(Function::SpecularAlbedo, &cases, arguments) {
        let [f0, r, cosine] = [*f0, *r, *cosine].map(f64::from);
        let off = f64::from(out.vec4(0).x) - mirrored_of_even_light(f0, 1.0, r * r, cosine);
        // The fit's own error, and 2e-3 of the sum.
        let most = if cosine > 0.2 { 0.022 } else { 0.07 };
        assert!(off.abs() < most, "f0 {f0}, roughness {r}, cosine {cosine}: off by {off}");
        (squares, weights) = (squares + cosine * off * off, weights + cosine);
    }
    // Over a sphere as the surface sees it.
    assert!((squares / weights).sqrt() < 0.007, "{}", (squares / weights).sqrt());
}

#[test]
fn kept_lobes_are_ggx_of_what_few_bits_keep() {
    let mut random = Random::new(14);
    let mut above = || {
        let d = random.direction().as_vec3();
        d.truncate().extend(d.z.abs().max(0.02)).normalize()
    };
    let directions: Vec<(Vec3, Vec3)> = (0..400).map(|_| (above(), above())).collect();
    let cases: Vec<(Vec3, f32, Vec3, f32, Vec3)> = directions
        .iter()
        .enumerate()
        .map(|(i, &(toward, o))| {
            let light = Vec3::new(random.unit() as f32, 1.0, random.unit() as f32) * [1e-3, 0.5, 300.0, 6e4][i % 4];
            (light, 1.0 + 99.0 * random.unit() as f32, toward, 0.15 + 0.85 * random.unit() as f32, o)
        })
        .collect();
    let arguments = |&(light, rise, toward, alpha, o): &(Vec3, f32, Vec3, f32, Vec3)| {
        Arguments::of_vectors(light.extend(rise), toward.extend(alpha), o.extend(0.0))
    };
    for ((light, rise, toward, alpha, o), out) in
        Gpu::new(&random_volume()).results(Function::ItemLobe, &cases, arguments)
    {
        let (kept, coming) = (out.vec4(0), out.vec4(1));
        // Half a step of eight bits (between half the range and all of it), of six; of ten across four units, of nine.
        assert!(
            (kept.truncate() - *light).abs().max_element() <= light.max_element() * 1.01 / 256.0,
            "{light} is {kept}"
        );
        assert!((kept.w / rise).log2().abs() <= 0.51 * 25f32.log2() / 36.0, "{rise} is {}", kept.w);
        assert!(
            coming.truncate().distance(*toward) < 4e-3 && (coming.w - alpha).abs() <= 0.51 / 511.0,
            "{toward}: {coming}"
        );
        // GGX with Smith's masking and Schlick's Fresnel (glTF 2.0, appendix B), in f64, of the packed values.
        let (l, o) = (coming.truncate().as_dvec3(), o.as_dvec3());
        let (h, a2) = ((l + o).normalize(), f64::from(coming.w).powi(2));
        let d = a2 / (std::f64::consts::PI * (h.z * h.z * (a2 - 1.0) + 1.0).powi(2));
        let masked = |z: f64| z + (z * z * (1.0 - a2) + a2).sqrt();
        let v = 1.0 / (masked(l.z) * masked(o.z));
        let grazing = (1.0 - o.dot(h)).powi(5);
        let most = DVec3::splat(f64::from(kept.w * kept.truncate().max_element()));
        let expected = kept.truncate().as_dvec3().lerp(most, grazing) * d * v;
        let error = (out.vec3(2).as_dvec3() - expected).abs().max_element() / expected.max_element();
        assert!(error < 2e-3, "from {l} to {o}, alpha {}: {} is not {expected}", coming.w, out.vec3(2));
    }
}

#[test]
fn refraction_is_its_twin_and_never_nan() {
    let mut random = Random::new(7);
    let cases: Vec<(Vec3, Vec3, f32)> = (0..600)
        .map(|i| (random.direction().as_vec3(), random.direction().as_vec3(), [1.0, 1.33, 1.5][i % 3]))
        .collect();
    let arguments = |&(incident, normal, ior): &(Vec3, Vec3, f32)| {
        let back = incident.dot(normal) > 0.0;
        let met = if back { -normal } else { normal };
        Arguments::of_vectors(incident.extend(ior), met.extend(f32::from(u8::from(back))), Vec4::ZERO)
    };
    let results = Gpu::new(&random_volume()).results(Function::RefractionDirection, &cases, arguments);
    for ((incident, normal, ior), out) in results {
        let expected = refraction_direction(*incident, *normal, *ior, Form::Right);
        // Near the critical angle the refracted direction's error is the square root of f32's rounding.
        assert!((out.vec3(0) - expected).length() < 1e-3, "{incident} {normal} {ior}: {out:?} is not {expected}");
    }
}

#[test]
fn clipping_is_exact_where_it_matters() {
    let mut random = Random::new(8);
    let mut triangles = Vec::new();
    for i in 0..2000 {
        let size = [0.1, 1.0, 8.0][i % 3];
        let mut corner = || (DVec3::splat(7.5) + (random.point() - 0.5) * size).as_vec3();
        triangles.push([corner(), corner(), corner()]);
    }
    let center = 7.5f32;
    let arguments =
        |t: &[Vec3; 3]| Arguments::of_vectors(t[0].extend(center), t[1].extend(center), t[2].extend(center));
    let mut touched = 0;
    for (t, out) in Gpu::new(&random_volume()).results(Function::ClipToVoxel, &triangles, arguments) {
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
fn a_triangle_in_a_face_s_plane_belongs_half_to_each_voxel() {
    let (mut random, mut triangles) = (Random::new(12), Vec::new());
    for i in 0..600 {
        let size = [0.3, 1.0, 8.0][i % 3];
        let (axis, plane) = (i / 3 % 3, [7.0, 8.0][i / 9 % 2]);
        let mut corner = || {
            let mut p = (DVec3::splat(7.5) + (random.point() - 0.5) * size).as_vec3();
            p[axis] = plane;
            p
        };
        triangles.push([corner(), corner(), corner()]);
    }
    let center = 7.5f32;
    let arguments =
        |t: &[Vec3; 3]| Arguments::of_vectors(t[0].extend(center), t[1].extend(center), t[2].extend(center));
    let mut filled = 0;
    for (t, out) in Gpu::new(&random_volume()).results(Function::ClipToVoxel, &triangles, arguments) {
        let polygon = Polygon::clipped(&t.map(|p| p.as_dvec3()), DVec3::splat(7.0), DVec3::splat(8.0));
        let area = 0.5 * polygon.area_vector().length();
        assert!((f64::from(out.0[0][3]) - area).abs() < 2e-5, "{t:?}: {out:?} is not {area}");
        if area > 1e-3 {
            filled += 1;
            assert!((out.vec3(0).as_dvec3() - polygon.centroid()).length() < 1e-3, "{t:?}: {out:?}");
        }
    }
    assert!(filled > 300, "{filled}");
}

#[test]
fn fixed_sums_know_no_order_and_lose_nothing_that_counts() {
    let gpu = Gpu::new(&random_volume());
    let mut random = Random::new(9);
    // From 2⁻²⁴, the smallest half, to 2¹⁵.
    let mut term = || Vec4::from_array(std::array::from_fn(|_| (random.unit() * 39.0 - 24.0).exp2() as f32));
    let terms: Vec<[Vec4; 3]> = (0..500).map(|_| [term(), term(), term()]).collect();
    let ordered = |order: [usize; 3]| {
        gpu.results(Function::FixedSum, &terms, move |t| Arguments::of_vectors(t[order[0]], t[order[1]], t[order[2]]))
    };
    for ((t, sum), (_, again)) in ordered([0, 1, 2]).into_iter().zip(ordered([2, 0, 1])) {
        assert_eq!(sum.0, again.0);
        for i in 0..4 {
            let exact: f64 = t.iter().map(|v| f64::from(v[i])).sum();
            // Three truncations to 2⁻³², and f32's own rounding.
            assert!((f64::from(sum.0[0][i]) - exact).abs() < 3.0 / 4_294_967_296.0 + exact * 1e-7, "{t:?} {sum:?}");
        }
    }
}

#[test]
fn a_triangle_lights_as_much_as_its_points_do() {
    let mut random = Random::new(11);
    let triangles: Vec<([DVec3; 3], DVec3)> = (0..300)
        .map(|i| {
            // From a hundredth of the distance to many times it, above, below and across the horizon.
            let size = 10f64.powf(-2.0 + 3.0 * f64::from(i) / 300.0);
            let center = random.direction();
            (std::array::from_fn(|_| center + random.direction() * size), random.direction())
        })
        .collect();
    let arguments = |([a, b, c], n): &([DVec3; 3], DVec3)| {
        let with = |p: &DVec3, w: f64| p.as_vec3().extend(w as f32);
        Arguments::of_vectors(with(a, n.x), with(b, n.y), with(c, n.z))
    };
    let mut crossing = 0;
    let results = Gpu::new(&random_volume()).results(Function::TriangleIrradiance, &triangles, arguments);
    for ((triangle, normal), out) in results {
        let expected = lamps::triangle_irradiance(triangle, *normal);
        let found = f64::from(out.vec4(0).x);
        let above = triangle.iter().filter(|p| p.dot(*normal) > 0.0).count();
        crossing += u32::from(above == 1 || above == 2);
        // f32's rounding, which grows with the size; errors below 10⁻⁶ are negligible beside a hemisphere's π.
        let tolerance = 2e-3 * expected.abs() + 1e-5;
        assert!((found - expected).abs() < tolerance, "{triangle:?}, {normal}: {found} is not {expected}");
    }
    assert!(crossing > 50, "{crossing} triangles cross the horizon");
}

#[test]
fn neighbours_in_a_square_share_all_directions() {
    for interleave in [2, 4] {
        let settings = gpu::with(Settings::corrected(), &[&format!("image.interleave={interleave}")]);
        let side = interleave as i32;
        // Any square of pixels, and of voxels in each of the three planes.
        let planes = [[IVec3::X, IVec3::Y], [IVec3::Y, IVec3::Z], [IVec3::Z, IVec3::X]];
        for ([u, v], corner) in planes.into_iter().zip([IVec3::new(3, 5, 0), IVec3::new(7, 1, 2), IVec3::new(0, 9, 6)])
        {
            let at = |i: i32| (corner + u * (i % side) + v * (i / side)).as_vec3().extend(0.0);
            let inputs: Vec<Arguments> =
                (0..side * side).map(|i| Arguments::of_vectors(at(i), Vec4::ZERO, Vec4::ZERO)).collect();
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

/// The share of uniform light that Fresnel's reflection at the half vector leaves, summed over a grid of directions of
/// equal shares. The tolerance covers the shader's polynomial (1e-5) and the grid.
#[test]
fn diffuse_share_is_the_mean_of_what_fresnel_leaves() {
    const GRID: usize = 400;
    let cases: Vec<(f32, f32)> = (1..=20).flat_map(|k| [(k as f32 / 20.0, 0.04), (k as f32 / 20.0, 0.5)]).collect();
    let arguments =
        |(nv, f0): &(f32, f32)| Arguments::of_vectors(Vec4::splat(*nv), Vec3::splat(*f0).extend(1.0), Vec4::ZERO);
    for ((nv, f0), out) in Gpu::new(&random_volume()).results(Function::DiffuseShare, &cases, arguments) {
        let (nv, f0) = (f64::from(*nv), f64::from(*f0));
        let v = DVec3::new((1.0 - nv * nv).sqrt(), 0.0, nv);
        let mut sum = 0.0;
        for i in 0..GRID {
            for j in 0..GRID {
                let (r2, turn) =
                    ((i as f64 + 0.5) / GRID as f64, std::f64::consts::TAU * (j as f64 + 0.5) / GRID as f64);
                let l = DVec3::new(r2.sqrt() * turn.cos(), r2.sqrt() * turn.sin(), (1.0 - r2).sqrt());
                let vh = v.dot((v + l).normalize());
                sum += 1.0 - f0 - (1.0 - f0) * (1.0 - vh).powi(5);
            }
        }
        let expected = sum / (GRID * GRID) as f64;
        assert!(
            (f64::from(out.0[0][0]) - expected).abs() < 5e-5,
            "nv {nv}, f0 {f0}: {} is not {expected}",
            out.0[0][0]
        );
    }
}
