//! The sky: its radiance, and samples of a map by its brightness. A uniform or graded sky is not sampled: scattered
//! rays find it, and on a diffuse surface they are already distributed by its irradiance.

use std::sync::Arc;

use glam::{Mat3, Vec3};

use super::lights::LightSample;
use crate::scene::Scene;
use crate::scene::sky::{SkyMap, place};

pub struct Sky {
    /// The mean, and the radiance that is added straight up.
    even: [Vec3; 2],
    map: Option<SampledMap>,
}

/// A map, and the cumulative distribution of its texels' brightness times their solid angle.
struct SampledMap {
    map: Arc<SkyMap>,
    /// The rotation from the map to the world.
    rotation: Mat3,
    /// The distribution of rows.
    rows: Vec<f32>,
    /// The distribution of columns in each row.
    columns: Vec<f32>,
}

impl Sky {
    pub fn new(scene: &Scene) -> Self {
        let map = scene.sky_map.as_ref().map(|map| SampledMap::new(map, scene.sky_rotation().as_mat3()));
        Self { even: [scene.sky, scene.sky_gradient], map }
    }

    /// Whether a part of it is not black.
    pub fn shines(&self) -> bool {
        self.even[0] != Vec3::ZERO
    }

    /// Radiance towards unit d.
    pub fn towards(&self, d: Vec3) -> Vec3 {
        match &self.map {
            Some(sampled) => sampled.map.towards(sampled.unturned(d)),
            None => self.even[0] + self.even[1] * d.y,
        }
    }

    /// The density per steradian with which [`Self::sample`] finds unit d.
    pub fn density(&self, d: Vec3) -> f32 {
        self.map.as_ref().map_or(0.0, |sampled| sampled.density(sampled.unturned(d)))
    }

    /// A direction with a density proportional to brightness.
    pub fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let sampled = self.map.as_ref()?;
        let unturned = sampled.direction(u);
        let (density, radiance) = (sampled.density(unturned), sampled.map.towards(unturned));
        let direction = sampled.rotation * unturned;
        let any = density > 0.0 && radiance != Vec3::ZERO;
        any.then(|| LightSample { direction, end: None, radiance: radiance / density, density: Some(density) })
    }
}

impl SampledMap {
    fn new(map: &Arc<SkyMap>, rotation: Mat3) -> Self {
        let texels = map.texels();
        let bright = |x: usize, y: usize| texels.get(x % texels.width, y).max_element();
        // A function that is linear between texels has, over a texel, a mean of 1/8, 6/8 and 1/8 of three texels.
        let blurred = |before: f32, here: f32, after: f32| (before + 6.0 * here + after) / 8.0;
        let across = |x: usize, y: usize| blurred(bright(x + texels.width - 1, y), bright(x, y), bright(x + 1, y));
        let mut columns = Vec::with_capacity(texels.width * texels.height);
        let (mut sum, mut row_sums) = (0.0, Vec::with_capacity(texels.height));
        for y in 0..texels.height {
            let (above, below) = (y.saturating_sub(1), (y + 1).min(texels.height - 1));
            let mut row = 0.0;
            let mut cumulative = Vec::with_capacity(texels.width);
            for x in 0..texels.width {
                row += f64::from(blurred(across(x, above), across(x, y), across(x, below)));
                cumulative.push(row);
            }
            columns.extend(cumulative.iter().map(|c| if row > 0.0 { (c / row) as f32 } else { 1.0 }));
            sum += row * texels.solid_angle(y);
            row_sums.push(sum);
        }
        let rows = row_sums.iter().map(|c| (c / sum) as f32).collect();
        Self { map: map.clone(), rotation, rows, columns }
    }

    fn unturned(&self, d: Vec3) -> Vec3 {
        self.rotation.transpose() * d
    }

    /// Chooses a row, a texel in it, and a uniform direction in the texel.
    fn direction(&self, u: [f32; 2]) -> Vec3 {
        let (width, height) = (self.map.width, self.map.height);
        let (y, down) = choose(&self.rows, u[0]);
        let (x, across) = choose(&self.columns[y * width..][..width], u[1]);
        let height_of = |row: f32| (std::f32::consts::PI * row / height as f32).cos();
        let (above, below) = (height_of(y as f32), height_of(y as f32 + 1.0));
        let up = above + (below - above) * down;
        let turn = std::f32::consts::TAU * ((x as f32 + across) / width as f32 - 0.5);
        let out = (1.0 - up * up).max(0.0).sqrt();
        Vec3::new(out * turn.cos(), up, out * turn.sin())
    }

    fn density(&self, d: Vec3) -> f32 {
        let (width, height) = (self.map.width, self.map.height);
        let [across, down] = place(d);
        let x = (across * width as f32) as usize % width;
        let y = ((down * height as f32) as usize).min(height - 1);
        let row = &self.columns[y * width..][..width];
        share(&self.rows, y) * share(row, x) / self.map.texels().solid_angle(y) as f32
    }
}

/// The interval of a cumulative distribution that contains u, and the position within it.
pub fn choose(cumulative: &[f32], u: f32) -> (usize, f32) {
    let i = cumulative.partition_point(|&c| c <= u).min(cumulative.len() - 1);
    let start = if i == 0 { 0.0 } else { cumulative[i - 1] };
    (i, ((u - start) / (cumulative[i] - start)).clamp(0.0, 1.0))
}

fn share(cumulative: &[f32], i: usize) -> f32 {
    cumulative[i] - if i == 0 { 0.0 } else { cumulative[i - 1] }
}
