//! The sheen lobe of KHR_materials_sheen: the distribution "Charlie" and its visibility (Estevez and Kulla 2017).

use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::Vec3;

use super::finish::SHEEN_ROUGHNESS_MIN;

/// Λ of the visibility, fitted as in the paper.
#[inline]
fn lambda(alpha: f32, cos: f32) -> f32 {
    const SHARP: [f32; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
    const BROAD: [f32; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
    let share = (1.0 - alpha) * (1.0 - alpha);
    // Not `std::array::from_fn`, which is not always inlined.
    let mixed = |i: usize| BROAD[i] + (SHARP[i] - BROAD[i]) * share;
    let [a, b, c, d, e] = [mixed(0), mixed(1), mixed(2), mixed(3), mixed(4)];
    let l = |x: f32| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cos < 0.5 { l(cos).exp() } else { (2.0 * l(0.5) - l(1.0 - cos)).exp() }
}

/// D · V for directions on the upper side, in a local frame with z along the normal, in 1/sr. The lobe is this times
/// the colour.
pub fn lobe(roughness: f32, wo: Vec3, wi: Vec3) -> f32 {
    let alpha = roughness * roughness;
    let h = (wo + wi).normalize();
    // The normal distribution D at the half vector's height over the surface, 1/sr.
    let sin2 = (1.0 - h.z * h.z).max(0.0);
    let d = (2.0 + 1.0 / alpha) * sin2.powf(0.5 * (1.0 / alpha)) / TAU;
    d / ((1.0 + lambda(alpha, wo.z) + lambda(alpha, wi.z)) * 4.0 * wo.z * wi.z)
}

/// Steps of the table along each axis.
pub const STEPS: usize = 32;

/// The share of uniform light from all directions that a white lobe reflects to a viewer; more than 1 near grazing
/// below a roughness of 0.25. Rows are roughnesses from the minimum to 1, columns the viewer's cosine to the normal
/// with steps that narrow towards grazing: (i / `STEPS`)².
pub static ALBEDO: LazyLock<Vec<[f32; STEPS + 1]>> = LazyLock::new(|| {
    let roughness = |row: usize| SHEEN_ROUGHNESS_MIN + (1.0 - SHEEN_ROUGHNESS_MIN) * row as f32 / STEPS as f32;
    let cos = |column: usize| (column as f32 / STEPS as f32).powi(2).max(1e-4);
    (0..=STEPS).map(|row| std::array::from_fn(|column| integrated(roughness(row), cos(column)))).collect()
});

/// The share of uniform light from all directions that a white sheen keeps from the layers below, by the same steps:
/// the mean over the light's directions of the larger of the two directions' albedos, at most 1.
pub static TAKEN: LazyLock<Vec<[f32; STEPS + 1]>> = LazyLock::new(|| {
    const HEIGHTS: usize = 64;
    let row = |albedos: &[f32; STEPS + 1]| {
        std::array::from_fn(|column| {
            let taken = |i: usize| {
                // With cosine-weighted samples, cos² is uniform.
                let cos = ((i as f32 + 0.5) / HEIGHTS as f32).sqrt();
                albedos[column].max(between(albedos, cos.sqrt())).min(1.0)
            };
            (0..HEIGHTS).map(taken).sum::<f32>() / HEIGHTS as f32
        })
    };
    ALBEDO.iter().map(row).collect()
});

/// The step of a table below a position from 0 to 1, and the fraction beyond it.
fn step(x: f32) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * STEPS as f32;
    let low = (x as usize).min(STEPS - 1);
    (low, x - low as f32)
}

fn between(row: &[f32; STEPS + 1], x: f32) -> f32 {
    let (low, part) = step(x);
    row[low] + (row[low + 1] - row[low]) * part
}

/// The albedo from the table.
pub fn albedo(roughness: f32, cos: f32) -> f32 {
    let (low, part) = step((roughness - SHEEN_ROUGHNESS_MIN) / (1.0 - SHEEN_ROUGHNESS_MIN));
    let [a, b] = [low, low + 1].map(|row| between(&ALBEDO[row], cos.max(0.0).sqrt()));
    a + (b - a) * part
}

/// The albedo by a midpoint rule over the hemisphere. Heights are squared twice, because much of the light comes from
/// the horizon.
fn integrated(roughness: f32, cos: f32) -> f32 {
    const HEIGHTS: usize = 96;
    const TURNS: usize = 96;
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..HEIGHTS {
        let u = (i as f32 + 0.5) / HEIGHTS as f32;
        let (z, step) = (u * u, 2.0 * u / HEIGHTS as f32);
        let r = (1.0 - z * z).sqrt();
        for k in 0..TURNS {
            // Half a turn suffices by symmetry.
            let (sin, cos) = (PI * (k as f32 + 0.5) / TURNS as f32).sin_cos();
            let wi = Vec3::new(r * cos, r * sin, z);
            sum += lobe(roughness, wo, wi) * z * step;
        }
    }
    sum * TAU / TURNS as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_integral() {
        for roughness in [0.07, 0.1, 0.16, 0.33, 0.5, 0.77, 1.0] {
            for cos in [0.003, 0.02, 0.1, 0.3, 0.57, 0.8, 1.0] {
                let (table, exact) = (albedo(roughness, cos), integrated(roughness, cos));
                // The tolerance is the error of linear interpolation between 33 × 33 entries.
                assert!(
                    (table - exact).abs() < 0.01 + 0.02 * exact,
                    "roughness {roughness}, cosine {cos}: {table}, not {exact}"
                );
            }
        }
    }
}
