//! Properties of the cones' sets, weights and steps that concern no single row of the ledger.

use glam::{Vec3, Vec4};

use super::ledger_formulas::{ray, volume, with};
use crate::twins::cone::*;
use crate::twins::mips::mip_chain;
use crate::twins::volume::{Level, TRAVEL};
use twobounce::gi::cones::choices::Form::Right;
use twobounce::gi::cones::choices::{ConeSet, Weights};

#[test]
fn weights_sum_to_what_they_claim() {
    for d in [Vec3::X, Vec3::ONE.normalize(), Vec3::new(0.6, -0.8, 0.0), Vec3::new(-0.48, 0.6, 0.64)] {
        let sum = |w| direction_weights(d, w).element_sum();
        assert!((sum(Weights::D2) - 1.0).abs() < 1e-6 && (sum(Weights::Norm1) - 1.0).abs() < 1e-6);
        assert!((sum(Weights::Abs) - d.abs().element_sum()).abs() < 1e-6);
    }
}

#[test]
fn extinction_makes_a_wall_block_the_same_at_every_angle() {
    // A wall that faces x: its y and z faces are empty. Steps of one voxel, two voxels thick so that none straddles it.
    let alpha = 0.6f32;
    let texels: Vec<Vec4> =
        (0..4096).map(|i| if (6..8).contains(&(i % 16)) { Vec4::splat(alpha) } else { Vec4::ZERO }).collect();
    let mut level: Level = std::array::from_fn(|_| vec![Vec4::ZERO; 4096]);
    for (target, travel) in TRAVEL.iter().enumerate() {
        if travel.x != 0.0 {
            level[target].clone_from(&texels);
        }
    }
    let volume = mip_chain(level, Right, Right);
    let open = |degrees: f32, weights| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Averaged over the phase of the steps.
        let sum: f32 = (0..32)
            .map(|i| {
                let direction = Vec3::new(cos, sin, 0.0);
                let start = (i as f32 + 0.5) / 32.0 / 16.0;
                let cone = Cone { start, ..ray(Vec3::new(0.2, 0.1, 0.5), direction) };
                1.0 - trace_cone(&volume, &cone, &with(|s| s.weights = weights)).value.w
            })
            .sum();
        sum / 32.0
    };
    let straight = open(0.0, Weights::Extinction);
    for degrees in [20.0, 40.0, 60.0] {
        let ratio = open(degrees, Weights::Extinction) / straight;
        // Steps of one voxel sample the wall's linear profile at a few points only.
        assert!((ratio - 1.0).abs() < 0.1, "{degrees}: {ratio}");
    }
    assert!(open(60.0, Weights::D2) > 1.5 * open(0.0, Weights::D2));
}

#[test]
fn transmittance_does_not_depend_on_the_step() {
    for alpha in [0.1f32, 0.5, 0.9, 0.99] {
        for steps in [0.1f32, 1.0 / 3.0, 0.5, 1.0, 2.0] {
            let left = (1.0 - opacity_correction(alpha, steps)).powf(1.0 / steps);
            assert!((left - (1.0 - alpha)).abs() < 1e-5, "{alpha} {steps}");
        }
    }
    assert_eq!((opacity_correction(1.0, 0.3), opacity_correction(0.0, 0.3)), (1.0, 0.0));
}

/// S6, and the limit of the set of five: over the floor of an empty room, with all faces of a voxel equal, most of the
/// light that its cones collect comes from the floor itself. A furnace cannot show that, since all its walls are
/// equally bright.
#[test]
fn wide_cones_collect_the_wall_that_they_leave() {
    const EDGE: u32 = 128; // the talk's
    const FLOOR: f32 = 2.0;
    let last = EDGE as f32 - 1.0 - FLOOR;
    let room = volume(EDGE, |v| {
        let on_wall = |x: f32| x == FLOOR || x == last;
        let within = v.cmpge(Vec3::splat(FLOOR)).all() && v.cmple(Vec3::splat(last)).all();
        match within && (on_wall(v.x) || on_wall(v.y) || on_wall(v.z)) {
            // Only the floor is bright.
            true => Vec3::splat(if v.y == FLOOR { 1.0 } else { 0.0 }).extend(1.0),
            false => Vec4::ZERO,
        }
    });
    let places = [0.2, 0.35, 0.5, 0.65, 0.8];
    let shares = |set: ConeSet| -> [f32; 2] {
        let settings = with(|s| s.set = set);
        let share = |x: f32, z: f32| {
            let floor = Vec3::new(x, (FLOOR + 0.5) / EDGE as f32, z);
            let found = gather_diffuse(&room, floor, Vec3::Y, Vec3::ZERO, &settings);
            found.radiance.x / (1.0 - found.open)
        };
        let all = places.iter().flat_map(|x| places.map(|z| share(*x, z)));
        all.fold([f32::INFINITY, 0.0], |[least, most], s| [least.min(s), most.max(s)])
    };
    let (five, sixteen) = (shares(ConeSet::Five), shares(ConeSet::Sixteen));
    println!("the floor's share of what is collected over it: {five:?} with five cones, {sixteen:?} with sixteen");
    assert!(five[0] > 0.75 && five[1] < 0.95, "{five:?}");
    assert!(sixteen[1] < five[0], "{sixteen:?}");
}
