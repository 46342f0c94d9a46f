//! The ledger's rows with a formula: each test states a property, measures by how much the printed form breaks it, and
//! checks that the right form keeps it.

use glam::{Mat3, Vec3, Vec4};
use proptest::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI, SQRT_2};

use crate::twins::cone::*;
use crate::twins::directions::*;
use crate::twins::mips::*;
use crate::twins::volume::{ISOTROPIC, TARGETS, TRAVEL, Volume};
use twobounce::gi::cones::choices::Form::{self, Printed, Right};
use twobounce::gi::cones::choices::{ConeSet, RoughnessFit};
use twobounce::gi::cones::constants::Cones;
use twobounce::gi::cones::{Ledger, Settings, Start};

/// Equal faces at level 0 by a function of the voxel, in a complete chain of right mips.
pub fn volume(edge: u32, texel: impl Fn(Vec3) -> Vec4) -> Volume {
    let n = edge as usize;
    let at = |i: usize| texel(Vec3::new((i % n) as f32, (i / n % n) as f32, (i / n / n) as f32));
    mip_chain(equal_faces((0..n * n * n).map(at).collect()), Right, Right)
}

/// A wall one voxel thick across x, opaque and white, at voxel `x`.
fn wall(edge: u32, x: f32) -> Volume {
    volume(edge, |v| if v.x == x { Vec4::ONE } else { Vec4::ZERO })
}

/// The right settings, with one change.
pub fn with(change: impl FnOnce(&mut Settings)) -> Settings {
    let mut settings = Settings::corrected();
    change(&mut settings);
    settings
}

pub fn ray(origin: Vec3, direction: Vec3) -> Cone {
    Cone { origin, direction, aperture: 0.0, start: 0.0, end: 10.0 }
}

#[test]
fn d1_a_negative_traveller_reads_its_own_volume() {
    // Equal faces at level 0, so level 1 cannot tell. Red and blue layers alternate: a traveller along −x meets a blue
    // one first, and must still see it at level 2.
    let (red, blue) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0));
    let texels: Vec<Vec4> = (0..64).map(|i| if i % 2 == 0 { red } else { blue }).collect();
    let of = |d1: Form| mip_chain(equal_faces(texels.clone()), d1, Right).levels()[2][3][0];
    assert_eq!(of(Right), blue);
    assert_eq!(of(Printed), red);
}

#[test]
fn d2_no_mip_is_more_than_opaque() {
    // The block's upper layer is empty, the lower one full: the fourth column counts its back voxel twice.
    let block: Block = std::array::from_fn(|i| if i / 2 % 2 == 0 { Vec4::ONE } else { Vec4::ZERO });
    assert_eq!(mip_directional(&block, 4, Printed).w, 1.25);
    assert_eq!(mip_directional(&block, 4, Right).w, 1.0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]
    #[test]
    fn d2_mips_stay_within_their_inputs(alphas in prop::collection::vec(0.0f32..=1.0, 512), bright in 0.1f32..100.0) {
        let texels: Vec<Vec4> = alphas.iter().map(|&a| Vec4::new(a * bright, 0.0, 0.0, a)).collect();
        let volume = mip_chain(equal_faces(texels), Right, Right);
        for texel in volume.levels().iter().flatten().flatten() {
            prop_assert!(texel.w <= 1.0);
            // 2⁻¹⁰: colour and alpha are each rounded to a half once per level.
            prop_assert!(texel.x <= texel.w * bright * (1.0 + 4.0 / 1024.0) + 1e-6);
        }
    }
}

#[test]
fn d3_the_index_has_as_many_brackets_as_it_needs() {
    let printed = "(((z * 2) + y) * 2) + x)";
    let count = |c| printed.matches(c).count();
    assert_eq!((count('('), count(')')), (3, 4));
    let mut seen: Vec<usize> = (0..8).map(|i| voxel_index(i & 1, i >> 1 & 1, i >> 2)).collect();
    assert_eq!(seen[1..3], [1, 2]);
    seen.sort_unstable();
    assert_eq!(seen, (0..8).collect::<Vec<_>>());
}

#[test]
fn d6_every_cone_of_a_set_points_away_from_the_surface() {
    let lowest = |form| cone_set(ConeSet::SixA, form, Right).iter().map(|c| c.direction.z).fold(1.0, f32::min);
    assert!((lowest(Printed) + 0.7558).abs() < 1e-3);
    assert!(lowest(Right) > 0.6);
    for set in ConeSet::ALL {
        let cones = cone_set(*set, Right, Right);
        assert!(cones.iter().all(|c| c.direction.z > 0.04 && (c.direction.length() - 1.0).abs() < 1e-6));
        assert!((cones.iter().map(|c| c.weight).sum::<f32>() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn d7_a_quarter_turn_about_z_takes_x_to_y() {
    let turned = |form| rotation(Vec3::Z, FRAC_PI_2, form) * Vec3::X;
    assert!((turned(Right) - Vec3::Y).length() < 1e-6);
    assert!((turned(Printed) + Vec3::Y).length() < 1e-6);
    let axis = Vec3::new(1.0, 2.0, 3.0).normalize();
    assert!(rotation(axis, 0.7, Right).abs_diff_eq(Mat3::from_axis_angle(axis, 0.7), 1e-6));
}

#[test]
fn d8_jitter_prefers_no_direction() {
    // Length of the mean direction over evenly spread numbers: sin(½)/½ = 0.96 as printed.
    let mean = |form| {
        let sum: Vec3 =
            (0..1000).map(|i| rotation(Vec3::Z, jitter_angle(i as f32 / 1000.0, form), Right) * Vec3::X).sum();
        sum.length() / 1000.0
    };
    assert!((mean(Printed) - 0.9589).abs() < 1e-3);
    assert!(mean(Right) < 1e-3);
}

#[test]
fn d10_a_cone_reaches_the_far_corner() {
    let lamp = volume(16, |v| if v.min_element() >= 14.0 { Vec4::ONE } else { Vec4::ZERO });
    let diagonal = ray(Vec3::splat(0.001), Vec3::ONE.normalize());
    let seen = |d10| trace_cone(&lamp, &diagonal, &with(|s| s.ledger.d10 = d10)).value.w;
    assert_eq!(seen(Printed), 0.0);
    assert!(seen(Right) > 0.7);
}

#[test]
fn d11_there_is_nothing_outside_the_volume() {
    // A full wall on the last layer; the cone runs beside the cube, half an edge outside it.
    let full = wall(8, 7.0);
    let beside = ray(Vec3::new(1.5, 0.5, 0.0), Vec3::Z);
    let seen = |d11| {
        let settings = with(|s| (s.ledger.d10, s.ledger.d11) = (Printed, d11));
        trace_cone(&full, &beside, &settings).value.w
    };
    assert_eq!((seen(Printed), seen(Right)), (1.0, 0.0));
}

/// Visibility of a light straight behind a slab of `alpha`, one voxel thick and two mips wide to every side.
fn shadow_of_slab(alpha: f32, settings: &Settings) -> f32 {
    let slab = volume(16, |v| if v.x == 8.0 { Vec4::splat(alpha) } else { Vec4::ZERO });
    let (from, to) = (Vec3::new(0.1, 0.53, 0.53), Vec3::new(0.95, 0.53, 0.53));
    trace_shadow_cone(&slab, from, Vec3::X, to, 0.0, 0.0, settings)
}

#[test]
fn d12_short_steps_do_not_count_as_whole_ones() {
    assert_eq!(opacity_correction(opacity_correction(0.5, 1.0), 1.0), 0.5);
    // Fog of alpha ½ per voxel, steps of ⅓ of one: over three steps ½ must remain; the printed form leaves ⅛.
    let fog = volume(16, |_| Vec4::splat(0.5));
    let per_voxel = |d12, step| {
        let settings = with(|s| {
            s.ledger.d12 = d12;
            s.ledger.d18 = Printed;
            s.shadow_step = step;
            (s.start.shadow_normal, s.start.shadow_along, s.start.shadow_end) = (0.0, 0.0, 0.0);
        });
        // Half a step short of the third voxel, so that exactly three voxels' worth of steps are taken.
        let length = (3.0 - 0.5 * step) / 16.0;
        let from = Vec3::splat(0.4);
        trace_shadow_cone(&fog, from, Vec3::Z, from + Vec3::X * length, 0.0, 0.0, &settings).powf(1.0 / 3.0)
    };
    let third = 1.0 / 3.0;
    assert!((1.0 - per_voxel(Printed, third) - 0.875).abs() < 1e-3);
    for step in [1.0, 0.5, third, 0.25, 0.1] {
        assert!((1.0 - per_voxel(Right, step) - 0.5).abs() < 1e-3, "step {step}");
    }
}

#[test]
fn d13_a_cone_one_voxel_wide_reads_level_0() {
    // A wall of alpha 1 halves at level 1 of the isotropic volume, so the remaining light tells the level.
    let left = |d13| {
        let settings = with(|s| {
            (s.ledger.d12, s.ledger.d13, s.ledger.d15) = (Printed, d13, Printed);
            s.shadow_step = 1.0;
            s.start.shadow_along = 8.5 - 1.6 - 2.0;
        });
        shadow_of_slab(1.0, &settings)
    };
    assert_eq!(left(Right), 0.0);
    assert!(left(Printed) > 0.2);
}

#[test]
fn d14_the_cube_is_0_to_1() {
    assert!(is_inside_cube(Vec3::ZERO) && is_inside_cube(Vec3::ONE) && is_inside_cube(Vec3::splat(0.5)));
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        assert!(!is_inside_cube(Vec3::splat(0.5) + 0.51 * axis) && !is_inside_cube(Vec3::splat(0.5) - 0.51 * axis));
    }
}

#[test]
fn d15_a_wall_stays_opaque_in_every_mip() {
    let wall = wall(16, 8.0);
    for level in 0..5 {
        let texel = |target: usize| wall.levels()[level][target].iter().map(|t| t.w).fold(0.0, f32::max);
        assert_eq!((texel(0), texel(3)), (1.0, 1.0));
        assert_eq!(texel(ISOTROPIC), 0.5f32.powi(level as i32));
    }
    // A cone of 20° reads level 2 at the wall, 6 voxels away.
    let left = |d15| {
        let settings = with(|s| s.ledger.d15 = d15);
        let (from, to) = (Vec3::new(0.1, 0.53, 0.53), Vec3::new(0.95, 0.53, 0.53));
        trace_shadow_cone(&wall, from, Vec3::X, to, 20f32.to_radians().tan(), 0.0, &settings)
    };
    assert!(left(Printed) > 4.0 * left(Right), "{} {}", left(Printed), left(Right));
    // One step of four voxels does not centre on the wall.
    assert!(left(Right) < 0.15, "{}", left(Right));
}

#[test]
fn d16_a_light_is_not_shadowed_by_its_own_voxels() {
    // The light lies in a ceiling; nothing else occludes it.
    let ceiling = wall(16, 14.0);
    let (from, to) = (Vec3::new(0.1, 0.53, 0.53), Vec3::new(14.5 / 16.0, 0.53, 0.53));
    let left = |end| {
        let settings = with(|s| s.start.shadow_end = end);
        trace_shadow_cone(&ceiling, from, Vec3::X, to, 0.0, 0.0, &settings)
    };
    assert!(left(Settings::printed().start.shadow_end) < 0.6);
    assert_eq!(left(Settings::corrected().start.shadow_end), 1.0);
    // A light on the surface: the listing divides 0 by 0.
    assert!((Vec3::ZERO / 0.0).is_nan());
    let settings = with(|s| (s.start.shadow_normal, s.start.shadow_end) = (0.0, 0.0));
    assert_eq!(trace_shadow_cone(&ceiling, from, Vec3::X, from, 0.0, 0.0, &settings), 1.0);
}

#[test]
fn d17_a_cone_is_never_narrower_than_a_voxel_nor_wider_than_itself() {
    let voxels = |s, form| cone_diameter(0.0, s, 32, form) * 32.0;
    assert_eq!((voxels(0.1, Printed), voxels(SQRT_2, Printed)), (0.5, SQRT_2));
    assert_eq!((voxels(0.1, Right), voxels(SQRT_2, Right)), (1.0, 1.0));
    assert_eq!((cone_diameter(0.5, 0.25, 32, Right), cone_diameter(0.5, 0.25, 32, Printed)), (0.25, 0.25));
}

#[test]
fn d18_a_cone_ends_when_little_can_be_added() {
    let fog = volume(64, |_| Vec4::splat(0.25));
    let trace = |d18| trace_cone(&fog, &ray(Vec3::new(0.0, 0.5, 0.5), Vec3::X), &with(|s| s.ledger.d18 = d18));
    let (printed, right) = (trace(Printed), trace(Right));
    // 0.75ⁿ < 1 − OPAQUE first at n = 19; the border's half voxel makes the first step half as dense.
    let (long, short) = (printed.look_ups.len(), right.look_ups.len());
    assert!(long >= 60 && short <= 20, "{long} {short}");
    assert!(printed.value.w - right.value.w <= 1.0 - OPAQUE);
}

/// Distance from the start of the cones' departure from the normal, and mip level, of each look-up of every diffuse
/// cone; distances in voxels.
fn diffuse_look_ups(edge: u32, settings: &Settings) -> Vec<Vec<[f32; 2]>> {
    let empty = volume(edge, |_| Vec4::ZERO);
    let from = Vec3::new(0.5, 0.1, 0.5);
    let apex = from + Vec3::Y * (settings.start.diffuse_normal / edge as f32);
    let look_ups = |(cone, _): (Cone, f32)| {
        let moved = (cone.origin - apex).dot(cone.direction);
        let of_apex = |[distance, level]: [f32; 2]| [(distance + moved) * edge as f32, level];
        trace_cone(&empty, &cone, settings).look_ups.into_iter().map(of_apex).collect()
    };
    diffuse_cones(from, Vec3::Y, edge, settings).into_iter().map(look_ups).collect()
}

#[test]
fn the_printed_diffuse_cones_look_where_the_slides_look() {
    // By hand, 128³, half angles of 45°: the diameter is twice the distance, which starts at 4 voxels and grows by the
    // diameter to 12, 36, 108 and 324, beyond √2·128; the looked-up point lies 0.01·128 voxels nearer.
    for cone in diffuse_look_ups(128, &Settings::printed()) {
        let expected = [[2.72, 3.0], [10.72, 4.585], [34.72, 6.170], [106.72, 7.755]];
        assert_eq!(cone.len(), expected.len());
        let near = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3;
        assert!(cone.iter().zip(expected).all(|(a, b)| near(*a, b)), "{cone:?}");
    }
}

#[test]
fn d19_cones_are_moved_by_as_many_voxels_in_every_grid() {
    let first = |edge: u32, s: &Settings| diffuse_look_ups(edge, s)[0][0][0];
    for (edge, printed) in [(32, 3.68), (64, 3.36), (128, 2.72)] {
        assert!((first(edge, &Settings::printed()) - printed).abs() < 1e-4, "{edge}");
        assert!((first(edge, &Settings::corrected()) - 2.72).abs() < 1e-4, "{edge}");
        let block = |s: &Settings| Cones::new(s, edge).diffuse_offset;
        assert_eq!((block(&Settings::printed()), block(&Settings::corrected())), (-0.01 * edge as f32, -1.28));
    }
}

#[test]
fn d20_a_wall_two_voxels_away_hides_what_is_behind_it() {
    let (red, blue) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0));
    let room = volume(64, |v| match v.x {
        8.0 => red,
        17.0.. => blue,
        _ => Vec4::ZERO,
    });
    // The narrowest set: wider cones blur the wall back into view from their blind start.
    let share_behind = |start: Start| {
        let settings = with(|s| (s.start, s.set) = (start, ConeSet::Sixteen));
        let seen = gather_diffuse(&room, Vec3::new(6.0 / 64.0, 0.5, 0.5), Vec3::X, Vec3::ZERO, &settings).radiance;
        seen.z / seen.element_sum()
    };
    let near = Start { diffuse_normal: 1.0, diffuse_along: 1.0, ..Start::default() };
    let (printed, right) = (share_behind(Settings::printed().start), share_behind(near));
    assert!(printed > 0.5, "{printed}");
    assert!(right < 0.05, "{right}");
}

#[test]
fn d21_the_sky_fills_what_the_cones_leave() {
    let empty = volume(16, |_| Vec4::ZERO);
    for set in ConeSet::ALL {
        let lit = |d21| {
            let settings = with(|s| (s.set, s.ledger.d21) = (*set, d21));
            gather_diffuse(&empty, Vec3::splat(0.5), Vec3::Y, Vec3::splat(3.0), &settings).radiance.x
        };
        assert_eq!(lit(Printed), 0.0);
        assert!((lit(Right) - 3.0).abs() < 1e-5);
    }
}

/// Largest change of the frame's axes over two normals an angle of 10⁻³ apart, over the angle.
fn frame_slope(normal: Vec3, towards: Vec3, form: Form) -> f32 {
    let step = 1e-3;
    let (a, b) = ((normal - towards * step / 2.0).normalize(), (normal + towards * step / 2.0).normalize());
    let (fa, fb) = (tangent_frame(a, form), tangent_frame(b, form));
    (0..3).map(|i| (fa.col(i) - fb.col(i)).length()).fold(0.0, f32::max) / step
}

#[test]
fn d22_the_tangent_frame_has_no_jumps() {
    // Along |n.y| = |n.z| the printed frame jumps by 60° to 90°.
    for x in [0.1f32, 0.5, 0.9] {
        let side = ((1.0 - x * x) / 2.0).sqrt();
        let normal = Vec3::new(x, side, side);
        let across = Vec3::new(0.0, 1.0, -1.0).normalize();
        assert!(frame_slope(normal, across, Printed) > 1000.0);
        assert!(frame_slope(normal, across, Right) < 2.0);
    }
    // Everywhere: orthonormal, right-handed, and with a rate of change of at most 1/(1 + n.z) near its one singular
    // direction.
    for i in 0..2000 {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
        let angle = i as f32 * PI * (3.0 - 5f32.sqrt());
        let normal = Vec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z);
        for form in [Printed, Right] {
            let frame = tangent_frame(normal, form);
            assert!((frame.transpose() * frame).abs_diff_eq(Mat3::IDENTITY, 1e-4), "{normal}");
            assert!((frame.determinant() - 1.0).abs() < 1e-4 && frame.z_axis == normal);
        }
        if z > -0.9 {
            let towards = normal.any_orthonormal_vector();
            assert!(frame_slope(normal, towards, Right) < 2.0 + 2.0 / (1.0 + z), "{normal}");
        }
    }
    assert!(tangent_frame(Vec3::NEG_Z, Right).is_finite());
}

#[test]
fn d23_refraction_starts_in_the_medium_that_it_enters() {
    let (incident, normal) = (Vec3::new(0.6, -0.8, 0.0), Vec3::Y);
    let direction = refraction_direction(incident, normal, 1.5, Right);
    let height = |form| refraction_origin(Vec3::ZERO, normal, direction, 1.0, 64, form).y * 64.0;
    assert_eq!((height(Printed), height(Right)), (1.0, -1.0));
    // A totally reflected ray stays on its own side.
    let steep = Vec3::new(0.8, 0.6, 0.0);
    let back = refraction_direction(steep, normal, 1.5, Right);
    assert!(refraction_origin(Vec3::ZERO, normal, back, 1.0, 64, Right).y < 0.0 && back.y < 0.0);
}

#[test]
fn d24_refraction_obeys_snell_on_both_sides() {
    for ior in [1.0f32, 1.33, 1.5] {
        for degrees in (0..90).step_by(3) {
            let (sin, cos) = (degrees as f32).to_radians().sin_cos();
            let into = refraction_direction(Vec3::new(sin, -cos, 0.0), Vec3::Y, ior, Right);
            assert!((into.x * ior - sin).abs() < 1e-5 && into.y < 0.0, "{ior} {degrees}");
            let out = refraction_direction(Vec3::new(sin, cos, 0.0), Vec3::Y, ior, Right);
            if sin * ior < 1.0 {
                assert!((out.x - sin * ior).abs() < 1e-4 && out.y >= 0.0, "{ior} {degrees}");
            } else {
                assert!((out - Vec3::new(sin, -cos, 0.0)).length() < 1e-5, "{ior} {degrees}");
            }
        }
    }
    // As printed, both cases are wrong: leaving glass at 60°, beyond total reflection, and entering air from within at
    // 60°.
    let leaving = Vec3::new(60f32.to_radians().sin(), 0.5, 0.0);
    assert!((refraction_direction(leaving, Vec3::Y, 1.5, Printed) - leaving.reflect(Vec3::Y)).length() > 0.1);
    assert!(refraction_direction(leaving * Vec3::new(1.0, -1.0, 1.0), Vec3::Y, 1.0 / 1.5, Printed).is_nan());
}

#[test]
fn d25_the_three_roughness_fits_disagree() {
    let degrees = |r, fit| roughness_to_aperture(r, fit).atan().to_degrees();
    let at_one = RoughnessFit::ALL.iter().map(|f| degrees(1.0, *f)).collect::<Vec<_>>();
    for (angle, stated) in at_one.iter().zip([47.5, 41.0, 67.5]) {
        assert!((angle - stated).abs() < 0.5, "{angle} {stated}");
    }
    for fit in RoughnessFit::ALL {
        let angles: Vec<f32> = (0..=20).map(|i| degrees(i as f32 / 20.0, *fit)).collect();
        assert!(angles.windows(2).all(|w| w[0] <= w[1]) && angles[0] < 1.0, "{fit}");
    }
}

#[test]
fn d26_a_set_keeps_the_cosine() {
    // Radiance cosθ over the hemisphere: E/π is ∫cos²θ dω / π = 2/3.
    let gathered = |d26| cone_set(ConeSet::Sixteen, Right, d26).iter().map(|c| c.weight * c.direction.z).sum::<f32>();
    assert!((gathered(Printed) - 0.49).abs() < 0.001);
    assert!((gathered(Right) - 2.0 / 3.0).abs() < 0.015);
}

#[test]
fn presets_hold_every_row_in_one_form() {
    assert_eq!(Settings::printed().ledger, Ledger::all(Printed));
    let right = Settings::printed().start;
    let right = Start { shadow_end: 2.0, ..right };
    assert_eq!(Settings::corrected(), Settings { ledger: Ledger::all(Right), start: right, ..Settings::printed() });
    assert_eq!(TARGETS, TRAVEL.len() + 1);
}
