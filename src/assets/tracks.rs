//! Motion: keys in seconds, dense enough that linear interpolation looks smooth.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use serde::Deserialize;

/// Keys of seconds and values, in order of time, the first at 0.
pub type Keys<const N: usize> = Vec<Keyframe<N>>;

#[derive(Clone, Deserialize)]
#[serde(try_from = "Vec<f64>")]
pub struct Keyframe<const N: usize>([f64; N]);

impl<const N: usize> TryFrom<Vec<f64>> for Keyframe<N> {
    type Error = String;

    fn try_from(numbers: Vec<f64>) -> Result<Self, String> {
        numbers.try_into().map(Self).map_err(|numbers| format!("a key has {} numbers instead of {N}", numbers.len()))
    }
}

/// Seconds between the keys that are written.
const STEP_S: f64 = 0.125;

/// Rotation about an axis: seconds, then degrees.
#[derive(Deserialize)]
pub struct Angle {
    axis: [f64; 3],
    keys: Keys<2>,
}

/// A chain of joints that bends back and forth about Z.
#[derive(Deserialize)]
pub struct Sway {
    pub joints: u32,
    /// The maximum rotation of each joint against the one below.
    degrees: f64,
    /// The period of one bend, which travels up the chain as a wave.
    period_s: f64,
    /// The phase as a share of the period, 0 to 1.
    phase: f64,
    /// The duration, a whole number of periods.
    lasts_s: f64,
}

/// The delay of a joint against the one below, as a share of the period.
const LATER: f64 = 0.09;

impl Angle {
    pub fn rotations(&self) -> Vec<(f64, [f64; 4])> {
        let axis = DVec3::from(self.axis).normalize();
        let turned = |[degrees]: [f64; 1]| DQuat::from_axis_angle(axis, degrees.to_radians()).to_array();
        smooth(&self.keys).into_iter().map(|(t, angle)| (t, turned(angle))).collect()
    }
}

impl Sway {
    pub fn rotations(&self, joint: u32) -> Vec<(f64, [f64; 4])> {
        let at = |t: f64| {
            let part = t / self.period_s + self.phase - LATER * f64::from(joint);
            DQuat::from_rotation_z(self.degrees.to_radians() * (TAU * part).sin()).to_array()
        };
        steps(self.lasts_s).map(|t| (t, at(t))).collect()
    }
}

/// Once around the Y axis: five keys, because a rotation takes the shorter way between two.
pub fn turn(seconds: f64) -> Vec<(f64, [f64; 4])> {
    let rotation = |part: f64| DQuat::from_rotation_y(TAU * part).to_array();
    [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| (seconds * part, rotation(part))).into()
}

/// Interpolates the keys smoothly and separately for each number, without overshoot: a cubic with the harmonic mean of
/// both sides' slopes at each key, 0 where they differ in sign (Fritsch and Butland, 1984, for uniform steps).
pub fn smooth<const N: usize, const M: usize>(keys: &[Keyframe<N>]) -> Vec<(f64, [f64; M])> {
    let slope =
        |from: usize, of: usize| (keys[from + 1].0[of] - keys[from].0[of]) / (keys[from + 1].0[0] - keys[from].0[0]);
    let tangent = |key: usize, of: usize| {
        if key == 0 || key + 1 == keys.len() {
            return 0.0;
        }
        let (before, after) = (slope(key - 1, of), slope(key, of));
        if before * after > 0.0 { 2.0 * before * after / (before + after) } else { 0.0 }
    };
    let value = |t: f64, of: usize| {
        let from = keys.iter().rposition(|key| key.0[0] <= t).unwrap_or(0).min(keys.len() - 2);
        let ([a, b], width) = ([keys[from].0[of], keys[from + 1].0[of]], keys[from + 1].0[0] - keys[from].0[0]);
        let x = (t - keys[from].0[0]) / width;
        let (m, n) = (width * tangent(from, of), width * tangent(from + 1, of));
        let (xx, xxx) = (x * x, x * x * x);
        (2.0 * xxx - 3.0 * xx + 1.0) * a + (xxx - 2.0 * xx + x) * m + (3.0 * xx - 2.0 * xxx) * b + (xxx - xx) * n
    };
    let lasts_s = keys.last().map_or(0.0, |key| key.0[0]);
    steps(lasts_s).map(|t| (t, std::array::from_fn(|of| value(t, of + 1)))).collect()
}

fn steps(lasts_s: f64) -> impl Iterator<Item = f64> {
    (0..=(lasts_s / STEP_S).round() as u32).map(|step| f64::from(step) * STEP_S)
}
