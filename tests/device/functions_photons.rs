//! The formulas of the method `photons` on the GPU: each is right, and the printed form of the notes is not.

use std::f32::consts::PI;

use crate::gpu::twins::octahedron;
use crate::photons::{Arguments, EDGE, Function, PhotonGpu, settings};
use crate::scenes::Random;
use glam::{IVec2, Vec2, Vec3, Vec4};

const TEXELS: usize = 16;

fn directions(count: usize) -> Vec<Vec3> {
    let mut random = Random::new(12);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    axes.into_iter().chain((0..count).map(|_| random.direction().as_vec3())).collect()
}

/// Middle, solid angle, and mean cosine to a normal.
type Texel = (Vec3, f32, f32);

/// For every normal the sixteen texels, and the sum of their shares.
fn texels(gpu: &PhotonGpu, normals: &[Vec3]) -> Vec<(Vec<Texel>, f32)> {
    let inputs: Vec<_> = normals
        .iter()
        .flat_map(|n| (0..TEXELS).map(|t| Arguments::of_vectors(n.extend(t as f32), Vec4::ZERO)))
        .collect();
    let found = gpu.evaluate(Function::Texel, &inputs, &settings(&[]));
    let of = |one: &[Arguments]| {
        let texels = one.iter().map(|y| (y.a().truncate(), y.a().w, y.b().x)).collect();
        (texels, one[0].b().y)
    };
    found.chunks(TEXELS).map(of).collect()
}

#[test]
fn places_and_directions_are_inverse_and_the_twins() {
    let gpu = PhotonGpu::new();
    let directions = directions(200);
    let inputs: Vec<_> = directions
        .iter()
        .map(|d| {
            Arguments::of_vectors(d.extend(0.0), (octahedron::place(d.as_dvec3())).as_vec2().extend(0.0).extend(0.0))
        })
        .collect();
    for (d, y) in directions.iter().zip(gpu.evaluate(Function::Octahedron, &inputs, &settings(&[]))) {
        let place = octahedron::place(d.as_dvec3()).as_vec2();
        // Rounding of f32, on a map of four; on the lower half's seams two places are one direction.
        let same = y.a().truncate().truncate().distance(place) < 1e-5 || d.z < 0.0 && d.x.min(d.y).abs() < 1e-5;
        assert!(same, "{d}: {} is not {place}", y.a());
        assert!(y.b().truncate().distance(*d) < 1e-5, "{d} comes back as {}", y.b());
    }
}

#[test]
fn every_triangle_sends_all_of_its_light_and_centres_lose_it() {
    let gpu = PhotonGpu::new();
    let normals = directions(100);
    let mut centres = (f32::MAX, 0.0_f32);
    for (n, (texels, total)) in normals.iter().zip(texels(&gpu, &normals)) {
        let sum: f32 = texels.iter().map(|(_, angle, cosine)| angle * cosine).sum();
        // The closed sum over mirror images is the sum over texels: f32's rounding over 64 terms.
        assert!((sum / total - 1.0).abs() < 1e-5, "{n}: {sum} is not {total}");
        // Stored light is divided by this sum; without the division the error is that of the quarters' means.
        assert!((sum / PI - 1.0).abs() < 0.023, "{n}: {sum}");
        for (t, (middle, angle, cosine)) in texels.iter().enumerate() {
            let (mean, exact) = octahedron::texel(t, n.as_dvec3());
            // Four middles of quarters represent the texel.
            assert!((f64::from(*cosine) - mean).abs() < 0.032, "{n}, texel {t}: {cosine} is not {mean}");
            assert!((f64::from(*angle) - exact).abs() < 1e-3, "texel {t}: {angle} is not {exact}");
            assert!(middle.is_normalized());
        }
        // As printed: a texel holds the whole radiance where its middle is in front, and nothing elsewhere.
        let in_front = texels.iter().filter(|(middle, ..)| middle.dot(*n) > 1e-5);
        let printed: f32 = in_front.map(|(_, angle, cosine)| angle * cosine).sum::<f32>() / PI;
        centres = (centres.0.min(printed), centres.1.max(printed));
    }
    // Towards ±z only four texels face the normal: a fifth is lost and more; towards ±x and ±y nothing is.
    assert!(centres.0 < 0.8 && centres.1 > 0.97, "centres send {centres:?} of the light");
}

/// The map is unfolded about z: of the cube's 48 symmetries it keeps the 16 that keep the z axis.
#[test]
fn texels_have_the_symmetries_of_z() {
    let gpu = PhotonGpu::new();
    let normals = directions(20);
    let sorted = |n: Vec3| {
        let (texels, _) = texels(&gpu, &[n]).remove(0);
        let mut cosines: Vec<f32> = texels.iter().map(|t| t.2).collect();
        cosines.sort_by(f32::total_cmp);
        cosines
    };
    let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5); // f32 rounding
    let mut differ = false;
    for n in normals {
        let own = sorted(n);
        for signs in 0..8 {
            let sign = |bit: u32| if signs >> bit & 1 == 1 { -1.0 } else { 1.0 };
            let m = Vec3::new(n.x * sign(0), n.y * sign(1), n.z * sign(2));
            assert!(near(&own, &sorted(m)) && near(&own, &sorted(Vec3::new(m.y, m.x, m.z))), "{n} and {m}");
        }
        differ |= !near(&own, &sorted(Vec3::new(n.z, n.y, n.x)));
    }
    assert!(differ, "x and z are alike too: say so in docs");
}

/// A cone finds the light that is sent towards its apex: in a fog with different light in every direction it sees
/// exactly the map's light at minus its axis. No two texels are equal, so no other order of them passes.
#[test]
fn a_cone_looks_up_the_direction_back_to_its_apex() {
    let gpu = PhotonGpu::new();
    let light = |texel: u32| texel as f32 / 16.0 + if texel.is_multiple_of(3) { 1.0 } else { 0.0 };
    gpu.fill_directions(|_, _, texel| (Vec4::new(light(texel), 0.0, 0.0, 1.0), Vec4::ONE));
    for d in directions(40) {
        let place = octahedron::place(-d.as_dvec3()).as_vec2() - 0.5;
        let (corner, part) = (place.floor(), place - place.floor());
        let mut expected = 0.0;
        for k in [IVec2::ZERO, IVec2::X, IVec2::Y, IVec2::ONE] {
            let (at, weight) = (corner.as_ivec2() + k, (Vec2::ONE - part - k.as_vec2()).abs());
            // The border is folded in its middle.
            let inside = at.clamp(IVec2::ZERO, IVec2::splat(3));
            let x = if at.y == inside.y { inside.x } else { 3 - inside.x };
            let y = if at.x == inside.x { inside.y } else { 3 - inside.y };
            expected += weight.x * weight.y * light((4 * y + x) as u32);
        }
        let [found, open, _] = gpu.trace(Vec3::splat(8.0), d, 0.1, &settings(&[]));
        // A sampler may weigh equal texels by fractions of 1/256, whose sum is 1: only rounding of f32 and f16 remains.
        // left.
        assert!((found - expected).abs() < 2e-3 && open == 0.0, "{d}: {found} is not {expected}, {open} open");
    }
}

/// A value on the map's border, reconstructed from both sides of its fold.
#[test]
fn folding_joins_the_border_and_repeating_does_not() {
    let gpu = PhotonGpu::new();
    let mut random = Random::new(3);
    let map: Vec<f32> = (0..TEXELS).map(|_| random.unit() as f32).collect();
    let value = |place: Vec2, fold: bool| -> f32 {
        let corner = (place - 0.5).floor();
        let part = place - 0.5 - corner;
        let neighbours = [IVec2::ZERO, IVec2::X, IVec2::Y, IVec2::ONE].map(|k| corner.as_ivec2() + k);
        let inputs = neighbours.map(|t| Arguments::of_vectors(Vec4::new(t.x as f32, t.y as f32, 0.0, 0.0), Vec4::ZERO));
        let folded = gpu.evaluate(Function::Folded, &inputs, &settings(&[]));
        let weights =
            [(1.0 - part.x) * (1.0 - part.y), part.x * (1.0 - part.y), (1.0 - part.x) * part.y, part.x * part.y];
        let texel = |k: usize| {
            let repeated = neighbours[k].clamp(IVec2::ZERO, IVec2::splat(3));
            let at = if fold { folded[k].a().truncate().truncate().as_ivec2() } else { repeated };
            map[(at.y * 4 + at.x) as usize]
        };
        (0..4).map(|k| weights[k] * texel(k)).sum()
    };
    let mut worst = 0.0_f32;
    for i in 0..8 {
        let y = (i as f32 + 0.5) / 2.0;
        for (a, b) in [(Vec2::new(0.0, y), Vec2::new(0.0, 4.0 - y)), (Vec2::new(y, 4.0), Vec2::new(4.0 - y, 4.0))] {
            assert!((value(a, true) - value(b, true)).abs() < 1e-5, "{a} and {b} are one direction");
            worst = worst.max((value(a, false) - value(b, false)).abs());
        }
    }
    assert!(worst > 0.2, "repeating the border differs by {worst}");
}

#[test]
fn spheres_are_bounded_and_the_printed_recursion_ends_or_stands_still() {
    let gpu = PhotonGpu::new();
    let own = settings(&[]).of.photons;
    let ratios = [0.0, 0.01, 0.3, 0.5, 0.99, 1.0, 1.7, 100.0, 1e6];
    let heights = [0.0, 0.01, 1.0, 7.0, 100.0];
    let cases: Vec<_> = ratios.iter().flat_map(|r| heights.map(|h| (h, *r))).collect();
    let inputs: Vec<_> =
        cases.iter().map(|(h, r)| Arguments::of_vectors(Vec4::new(1.0, *h, *r, 0.0), Vec4::ZERO)).collect();
    let of = |changes: &[&str]| gpu.evaluate(Function::Spheres, &inputs, &settings(changes));
    let right = of(&[]);
    let steps = of(&["photons.ledger.steps=printed"]);
    let printed = of(&["photons.ledger.steps=printed", "photons.ledger.still=printed"]);
    for (i, (height, ratio)) in cases.iter().enumerate() {
        let (height, ratio, case) = (*height, *ratio, format!("h {height}, R {ratio}"));
        // The first sphere, from `height` on, and the one that touches the sphere at `height`.
        let [middle, extent, after, after_extent] = right[i].0[1];
        for (front, middle, extent) in [(height, middle, extent), (height * (1.0 + ratio), after, after_extent)] {
            assert!(middle.is_finite() && extent >= own.least_step, "{case}: {middle}, {extent}");
            // Each sphere touches the one before,
            assert!((middle - 0.5 * extent - front).abs() <= 1e-5 * middle, "{case}: {middle}, {extent}");
            // and is no wider than the cone, or than the bounds.
            let r = ratio.min(own.most_ratio);
            assert!(extent <= (2.0 * r * middle).max(own.least_step) * 1.00001, "{case}: {extent}");
        }
        let [_, _, after, after_extent] = printed[i].0[1];
        if ratio >= 1.0 {
            // Printed: the recursion does not advance,
            assert!(after_extent < 0.0 && steps[i].0[1][3] < 0.0, "{case}: {after_extent}");
        } else {
            // else h' = (h + hR)/(1 − R), which is h where either is 0.
            let next = (height + height * ratio) / (1.0 - ratio);
            assert!((after - next).abs() <= 1e-5 * next, "{case}: {after} is not {next}");
            assert!((after_extent - 2.0 * ratio * next).abs() <= 1e-5 * next, "{case}: {after_extent}");
            assert!(ratio * height > 0.0 || after == height, "{case}: {after}");
            // With that row alone corrected every sphere advances.
            assert!(steps[i].0[1][2] > height && steps[i].0[1][3] >= own.least_step, "{case}: {:?}", steps[i]);
        }
    }
}

/// A mirror's cone, R = 0, does not advance beyond a voxel from its apex as printed: it finds nothing, and all is open.
#[test]
fn a_cone_that_narrows_to_nothing_finds_a_wall_and_printed_nothing() {
    let gpu = PhotonGpu::new();
    gpu.fill(|level, at| {
        let wall = if at[0] == 12 >> level { 1.0 } else { 0.0 };
        (Vec4::new(wall, 0.0, 0.0, wall), Vec4::splat(wall))
    });
    for composite in ["photons.composite=over", "photons.composite=sum"] {
        let look = |still: &str| {
            let still = format!("photons.ledger.still={still}");
            gpu.trace(Vec3::new(2.0, 8.0, 8.0), Vec3::X, 0.0, &settings(&[composite, &still]))
        };
        let [light, open, _] = look("right");
        // The sphere in the middle of the wall's voxel: all of it.
        assert!((light - 1.0).abs() < 1e-3 && open == 0.0, "{composite}: {light}, open {open}");
        let [light, open, _] = look("printed");
        assert_eq!((light, open), (0.0, 1.0), "{composite}");
    }
}

/// Ω = min(1/(N·pdf), 2π): cosine-distributed cones of one N add up to the hemisphere, weighted by their cosines.
#[test]
fn solid_angles_are_the_rules() {
    let gpu = PhotonGpu::new();
    for half_angle in [0.05_f32, 0.3, 0.7, 1.2, 1.5] {
        let solid_angle = 2.0 * PI * (1.0 - half_angle.cos());
        let input = Arguments::of_vectors(Vec4::new(solid_angle, 1.0, 0.1, 0.0), Vec4::ZERO);
        let ratio = gpu.evaluate(Function::Spheres, &[input], &settings(&[]))[0].a().x;
        // 1 − cos loses digits in f32 at small angles: 1e-7 of 1e-3.
        assert!((ratio / half_angle.tan() - 1.0).abs() < 1e-3, "half angle {half_angle}: {ratio}");
    }
}

/// α of one voxel's edge, everywhere and at every level.
fn medium(gpu: &PhotonGpu, alpha: f32, radiance: f32) {
    gpu.fill(|level, _| {
        let a = 1.0 - (1.0 - alpha).powi(1 << level);
        (Vec4::new(radiance * a, 0.0, 0.0, a), Vec4::splat(a))
    });
}

const OVER: [&str; 2] = ["photons.composite=over", "photons.opacity=samples"];

fn over(more: &[&str]) -> twobounce::settings::Settings {
    settings(&[&OVER, more].concat())
}

#[test]
fn a_medium_lets_through_the_same_in_any_steps_and_the_printed_exponent_does_not() {
    let gpu = PhotonGpu::new();
    medium(&gpu, 0.1, 1.0);
    let steps =
        ["photons.least_step=0.125", "photons.least_step=0.25", "photons.least_step=0.5", "photons.least_step=1"];
    // Along an axis from the first texel's middle to the last one's: filtering meets the border only at both ends.
    let through = |step: &str, printed: &[&str]| {
        gpu.trace(Vec3::new(0.5, 8.0, 8.0), Vec3::X, 0.001, &over(&[&[step], printed].concat()))[1]
    };
    let right = steps.map(|step| through(step, &[]));
    let exact = 0.9_f32.powf(15.5);
    for (step, found) in steps.iter().zip(right) {
        // The last sphere may reach half a voxel beyond the border, and filtering fades over the last half: a tenth
        // each.
        assert!((found / exact - 1.0).abs() < 0.1, "{step}: {found} is not {exact}");
    }
    let printed = steps.map(|step| through(step, &["photons.ledger.beer=printed"]));
    let spread = |v: &[f32]| v.iter().copied().fold(0.0, f32::max) / v.iter().copied().fold(1.0, f32::min).max(1e-6);
    assert!(spread(&right) < 1.1 && spread(&printed) > 3.0, "{right:?} {printed:?}");
}

#[test]
fn light_is_what_is_hidden_times_radiance_and_printed_is_not() {
    let gpu = PhotonGpu::new();
    medium(&gpu, 0.5, 2.0);
    for (ratio, step) in
        [(0.001, "photons.least_step=0.25"), (0.3, "photons.least_step=1"), (2.0, "photons.least_step=1")]
    {
        let look =
            |more: &[&str]| gpu.trace(Vec3::splat(2.0), Vec3::ONE.normalize(), ratio, &over(&[&[step], more].concat()));
        let [light, open, _] = look(&[]);
        // Two roundings to f16; an opening of less than half a percent counts as closed.
        assert!((light / (2.0 * (1.0 - open)) - 1.0).abs() < 0.01, "R {ratio}: {light}, open {open}");
        let [light, open, _] = look(&["photons.ledger.color=printed"]);
        if ratio < 0.1 {
            assert!(light > 2.0 * 1.2 * (1.0 - open), "short steps count whole colours: {light}, open {open}");
        }
    }
}

/// The notes' formula: Σ photons · v²/D² of a plane is the light that one of its photons sends, for cones of every
/// diameter at and between levels. A level holds Σ · v²/edge²; from the grid's edge on a cone finds its photons alone.
#[test]
fn summed_photons_times_their_area_over_the_cones_are_the_planes_light() {
    let gpu = PhotonGpu::new();
    let sent = 3.0;
    gpu.fill(|level, _| {
        let (photons, face) = (4.0_f32.powi(level as i32), 4.0_f32.powi(level as i32));
        (Vec4::new(sent * photons / face, 0.0, 0.0, photons / face), Vec4::splat(photons / face))
    });
    let printed = [
        "photons.composite=over",
        "photons.opacity=samples",
        "photons.ledger.color=printed",
        "photons.ledger.mips=printed",
        "photons.ledger.premultiplied=printed",
        "photons.most_ratio=0.9",
        "photons.start_along=8",
    ];
    let mut between = 0;
    for ratio in [0.06_f32, 0.08, 0.1, 0.15, 0.2, 1.0 / 3.0, 0.4, 0.45, 0.5, 0.6, 0.8] {
        // The first sphere lies in the middle of the grid, and hides all that is behind it.
        let middle = 8.0 / (1.0 - ratio);
        let diameter = 2.0 * ratio * middle;
        let [found, open, _] = gpu.trace(Vec3::new(8.0 - middle, 8.0, 8.0), Vec3::X, ratio, &settings(&printed));
        let expected = sent * (EDGE as f32 / diameter).powi(2).min(1.0);
        assert!((found / expected - 1.0).abs() < 1e-3 && open == 0.0, "D {diameter}: {found} is not {expected}");
        between += usize::from(diameter < EDGE as f32 && diameter.log2().fract() > 0.1);
    }
    assert!(between > 4, "{between} diameters between levels");
}

/// An opaque fog whose map states that three fifths of it send 0.3: the light of a full part is 0.5; the notes'
/// premultiplied value is used directly.
#[test]
fn premultiplied_light_counts_as_it_is_or_with_the_opacity_that_is_met() {
    let gpu = PhotonGpu::new();
    gpu.fill(|_, _| (Vec4::new(0.3, 0.0, 0.0, 0.6), Vec4::ONE));
    let light = |form: &str| {
        let form = format!("photons.ledger.premultiplied={form}");
        gpu.trace(Vec3::splat(6.0), Vec3::X, 0.1, &over(&[&form]))[0]
    };
    // Roundings to f16.
    assert!((light("right") - 0.5).abs() < 1e-3, "{}", light("right"));
    assert!((light("printed") - 0.3).abs() < 1e-3, "{}", light("printed"));
}

/// A wall of one voxel, at any place between samples.
#[test]
fn a_wall_is_one_wall_in_a_sum_and_leaks_under_over() {
    let gpu = PhotonGpu::new();
    gpu.fill(|level, at| {
        let wall = if at[0] == 12 >> level { 1.0 } else { 0.0 };
        (Vec4::new(wall, 0.0, 0.0, wall), Vec4::new(wall, 0.0, 0.0, wall))
    });
    let mut leaks = (0.0_f32, 0.0_f32);
    for i in 0..16 {
        let from = Vec3::new(1.0 + i as f32 / 16.0, 8.0, 8.0);
        for step in ["photons.least_step=0.25", "photons.least_step=1"] {
            let open = |how: &[&str]| gpu.trace(from, Vec3::X, 0.001, &settings(&[&[step], how].concat()))[1];
            // A cone that is open by less than half a percent counts as closed.
            leaks.0 = leaks.0.max(open(&[]));
            leaks.1 = leaks.1.max(open(&["photons.composite=over"]));
        }
    }
    assert!(leaks.0 <= 0.006 && leaks.1 > 0.2, "{leaks:?}");
    // Wide cones sample the wall coarsely, and their spheres' shares add up to one wall only on average.
    for ratio in [0.1, 0.25, 0.5] {
        let open = |i: u32| gpu.trace(Vec3::new(1.0 + i as f32 / 4.0, 8.0, 8.0), Vec3::X, ratio, &settings(&[]))[1];
        let mean = (0..32).map(open).sum::<f32>() / 32.0;
        // Half of the last sphere, and all that follow, lie beyond the grid: at R = ½ each is three times as wide as
        // the one before.
        let most = if ratio < 0.5 { 0.15 } else { 0.35 };
        assert!(mean < most, "R {ratio}: {mean} of a wall is open");
    }
}

#[test]
fn visibility_is_weighted_whole_and_the_printed_sum_is_not() {
    let gpu = PhotonGpu::new();
    for rate in ["0", "0.05", "1", "20"] {
        let rate = format!("photons.ao_rate={rate}");
        let near =
            |more: &[&str]| gpu.trace(Vec3::splat(8.0), Vec3::X, 0.3, &settings(&[&[rate.as_str()], more].concat()))[2];
        // The volume is empty: all weights add up to 1.
        assert!((near(&[]) - 1.0).abs() < 1e-5, "{rate}: {}", near(&[]));
        if rate.ends_with("0.05") {
            assert!(near(&["photons.ledger.ao=printed"]) < 0.7, "{}", near(&["photons.ledger.ao=printed"]));
        }
    }
    // A wall four voxels away: only what lies before it is open. 1 − exp(−λ·4), up to a step of one voxel.
    gpu.fill(|level, at| {
        let wall = if at[0] == 12 >> level { 1.0 } else { 0.0 };
        (Vec4::new(0.0, 0.0, 0.0, wall), Vec4::splat(wall))
    });
    let from = Vec3::new(8.5, 8.0, 8.0);
    let right = gpu.trace(from, Vec3::X, 0.001, &settings(&["photons.ao_rate=0.2"]))[2];
    let bounds = [1.0 - (-0.2_f32 * 3.0).exp(), 1.0 - (-0.2_f32 * 5.0).exp()];
    assert!((bounds[0]..=bounds[1]).contains(&right), "{right} is not within {bounds:?}");
}
