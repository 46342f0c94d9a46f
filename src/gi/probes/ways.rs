//! Directions of the rays of all probes: points spread evenly over the sphere. In each pass they have a rotation
//! that depends on the pass alone.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

/// The irrational steps of the R3 sequence (Roberts, 2018): powers of the inverse of the root of x⁴ = x + 1.
const R3: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_97];

/// The rotation of a pass; pass 0 has none. Passes sample all rotations uniformly: each maps three numbers of a
/// sequence to a rotation (Shoemake, "Uniform Random Rotations", 1992).
pub fn turn(pass: u32) -> DQuat {
    if pass == 0 {
        return DQuat::IDENTITY;
    }
    let [u, v, w] = R3.map(|step| (f64::from(pass) * step).fract());
    let (low, high) = ((1.0 - u).sqrt(), u.sqrt());
    let (a, b) = (TAU * v, TAU * w);
    DQuat::from_xyzw(low * a.sin(), low * a.cos(), high * b.sin(), high * b.cos())
}

/// `count` unit directions, rotated: the spherical Fibonacci points. Their heights are evenly spaced, and their
/// longitudes differ by the golden angle (Keinert et al., "Spherical Fibonacci Mapping", 2015).
pub fn ways(count: u32, turn: DQuat) -> Vec<[f32; 3]> {
    let golden_angle = PI * (3.0 - 5f64.sqrt());
    let way = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (r, phi) = ((1.0 - z * z).sqrt(), golden_angle * f64::from(i));
        (turn * DVec3::new(r * phi.cos(), r * phi.sin(), z)).normalize().as_vec3().to_array()
    };
    (0..count).map(way).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, Vec3};

    #[test]
    fn ways_are_spread_evenly_in_every_pass() {
        for pass in 0..50 {
            let ways = ways(256, turn(pass));
            let mut mean = DVec3::ZERO;
            let mut squares = DMat3::ZERO;
            for way in &ways {
                let d = Vec3::from(*way).as_dvec3();
                assert!((d.length() - 1.0).abs() < 1e-6);
                mean += d / 256.0;
                squares += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * (1.0 / 256.0);
            }
            // Means over a sphere, except for the errors of its first and last rings.
            assert!(mean.length() < 5e-3, "pass {pass}: {mean}");
            assert!((squares - DMat3::from_diagonal(DVec3::splat(1.0 / 3.0))).to_cols_array().iter().all(|e| e.abs() < 5e-3));
        }
        assert_ne!(ways(32, turn(1)), ways(32, turn(2)));
    }

    #[test]
    fn turns_have_no_middle() {
        let mean = (1..=4096).map(|pass| turn(pass) * DVec3::X).sum::<DVec3>() / 4096.0;
        // The tolerance is the discrepancy of a sequence of that length.
        assert!(mean.length() < 5e-3, "{mean}");
    }
}
