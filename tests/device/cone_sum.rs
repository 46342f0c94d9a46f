//! Properties of compositing by sums, checked on the twin of the cones (tests/device/functions_cones.rs compares the
//! shaders with it): light depends neither on the length and phase of steps nor on the axes of the grid.

use crate::gpu::twins;

use crate::scenes::Random;
use glam::{Mat3, UVec3, Vec3, Vec4};
use twins::cone::{Cone, trace_cone};
use twins::mips::mip_chain;
use twins::volume::{ISOTROPIC, Level, TRAVEL, Volume, texel_index};
use twobounce::gi::cones::Settings;
use twobounce::gi::cones::choices::{ConeSet, Form};

const EDGE: u32 = 16;

fn empty() -> Level {
    std::array::from_fn(|_| vec![Vec4::ZERO; EDGE.pow(3) as usize])
}

/// The position of texel `index` of a grid.
fn texel(index: u32) -> UVec3 {
    UVec3::new(index % EDGE, index / EDGE % EDGE, index / (EDGE * EDGE))
}

/// A wall of one voxel across x, whose radiance equals its opacity.
fn wall(alpha: f32) -> Volume {
    let mut level = empty();
    for target in [0, 3] {
        for y in 0..EDGE {
            for z in 0..EDGE {
                level[target][texel_index(UVec3::new(7, y, z), EDGE)] = Vec4::splat(alpha);
            }
        }
    }
    mip_chain(level, Form::Right, Form::Right)
}

/// Alpha of a thin cone through the wall at `degrees` from its normal, for 32 phases of its steps.
fn alphas(volume: &Volume, degrees: f32, step: f32) -> Vec<f32> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let settings = Settings { set: ConeSet::G8, step, ..Settings::default() };
    (0..32)
        .map(|phase| {
            let start = (phase as f32 + 0.5) / 32.0 / EDGE as f32;
            let direction = Vec3::new(cos, sin, 0.0);
            let cone = Cone { origin: Vec3::new(0.2, 0.1, 0.5), direction, aperture: 0.0, start, end: 2.0 };
            trace_cone(volume, &cone, &settings).value.w
        })
        .collect()
}

#[test]
fn a_sum_does_not_depend_on_the_step() {
    for alpha in [0.3, 0.6, 1.0] {
        for step in [0.25, 0.5, 1.0] {
            for found in alphas(&wall(alpha), 0.0, step) {
                // Rounding of positions; and a cone ends at an opacity of 0.995.
                assert!(
                    (found - alpha).abs() < if alpha < 1.0 { 1e-4 } else { 0.005 },
                    "alpha {alpha}, step {step}: {found}"
                );
            }
        }
    }
}

#[test]
fn a_sum_is_the_walls_alpha_at_every_angle() {
    let wall = wall(0.6);
    for degrees in [20.0, 40.0, 60.0] {
        for step in [0.25, 0.5, 1.0] {
            let all = alphas(&wall, degrees, step);
            let mean = all.iter().sum::<f32>() / all.len() as f32;
            // In the mean over the phases; with a single one the number of samples in the wall's linear profile differs
            // by one.
            assert!((mean - 0.6).abs() < 0.01, "{degrees}°, step {step}: {mean}");
        }
    }
}

/// The cube's symmetries, as matrices of 0 and ±1.
fn symmetries() -> Vec<Mat3> {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let signed = |order: [usize; 3], signs: u32| {
        let column = |k: usize| Vec3::AXES[order[k]] * if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
        Mat3::from_cols(column(0), column(1), column(2))
    };
    orders.into_iter().flat_map(|order| (0..8).map(move |signs| signed(order, signs))).collect()
}

/// Every texel moves as `turn` turns the grid about its middle, and its targets to the turned directions.
fn turned(level: &Level, turn: Mat3) -> Level {
    let middle = Vec3::splat(0.5 * (EDGE - 1) as f32);
    let mut to = empty();
    for index in 0..EDGE.pow(3) {
        let at = (turn * (texel(index).as_vec3() - middle) + middle).round().as_uvec3();
        for (target, texels) in level.iter().enumerate() {
            let goes = TRAVEL.get(target).map_or(ISOTROPIC, |travel| {
                TRAVEL.iter().position(|t| t.distance(turn * *travel) < 0.5).expect("an axis")
            });
            to[goes][texel_index(at, EDGE)] = texels[index as usize];
        }
    }
    to
}

#[test]
fn no_axis_of_the_grid_is_another() {
    let mut random = Random::new(3);
    let mut level = empty();
    for index in 0..EDGE.pow(3) as usize {
        // A third is occupied, each side by itself.
        let occupied = random.unit() < 0.3;
        for target in &mut level {
            let light = random.point().as_vec3();
            let alpha = random.unit() as f32;
            target[index] = if occupied { (light * alpha).extend(alpha) } else { Vec4::ZERO };
        }
    }
    let cones: Vec<(Vec3, Vec3)> =
        (0..20).map(|_| (random.point().as_vec3() - 0.5, random.direction().as_vec3())).collect();
    let through = |level: Level, turn: Mat3, settings: &Settings| -> Vec<Vec4> {
        let volume = mip_chain(level, Form::Right, Form::Right);
        let cone = |&(origin, direction): &(Vec3, Vec3)| {
            let (origin, direction) = (turn * origin + 0.5, turn * direction);
            Cone { origin, direction, aperture: 0.3, start: 1.0 / EDGE as f32, end: 2.0 }
        };
        cones.iter().map(|c| trace_cone(&volume, &cone(c), settings).value).collect()
    };
    assert_eq!(symmetries().len(), 48);
    for settings in [Settings::default(), Settings::corrected()] {
        let straight = through(level.clone(), Mat3::IDENTITY, &settings);
        assert!(straight.iter().any(|v| v.w > 0.5));
        for turn in symmetries() {
            for (a, b) in straight.iter().zip(through(turned(&level, turn), turn, &settings)) {
                // The mips are rounded to halves, after sums in another order.
                assert!((*a - b).abs().max_element() < 2e-3, "{turn}: {a} and {b}");
            }
        }
    }
}
