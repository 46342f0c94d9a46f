//! Averages of a map without its bright part over cones of different widths, for wide lookups. Level 0 is the
//! cosine-weighted mean over the hemisphere about a direction, level 1 the mean over a cone of half angle 45°, and each
//! further level halves the angle. Each level is an equirectangular map, twice as wide as high: levels 0 and 1 have 16
//! rows, each further one twice as many. `glsl/ground/sky.glsl` reads them.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::{SkyMap, Texels, middle, pack};

const ROWS: usize = 16;
/// The finest level has 512 rows of 1.4°.
const MOST_LEVELS: usize = 7;
/// Rows of the averaged source per row of a level.
const FINER: usize = 2;

/// The number of levels and their texels, the coarsest first.
pub fn make(texels: &Texels, most: f32) -> (usize, Vec<u32>) {
    // Levels are not finer than the map.
    let levels = (2..=MOST_LEVELS).rev().find(|levels| rows(levels - 1) <= texels.height).unwrap_or(2);
    let words = (0..levels).flat_map(|level| {
        let source = RowSums::new(texels, most, FINER * rows(level));
        let mean = |towards: DVec3| match level {
            0 => source.cosine_mean(towards),
            _ => source.cone_mean(towards, FRAC_PI_4 / f64::from(1 << (level - 1))),
        };
        let height = rows(level);
        let size = [2 * height, height];
        let texel = |i: usize| pack(mean(middle(i % size[0], i / size[0], size)).as_vec3());
        (0..size[0] * height).into_par_iter().map(texel).collect::<Vec<_>>()
    });
    (levels, words.collect())
}

impl SkyMap {
    /// How often the cone of the last level is halved until it is as narrow as a texel.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn octaves(&self) -> f32 {
        let last = FRAC_PI_4 / f64::from(1 << (self.levels - 2));
        (last / (PI / (2 * self.height) as f64)).log2().max(0.1) as f32
    }
}

fn rows(level: usize) -> usize {
    ROWS << level.max(1) >> 1
}

/// A map as prefix sums along its rows, from the left.
struct RowSums {
    width: usize,
    height: usize,
    /// `width + 1` per row.
    sums: Vec<DVec3>,
}

impl RowSums {
    /// A map with `height` rows: each texel is the mean over the texels of its area, or interpolated if the source is
    /// coarser.
    fn new(texels: &Texels, most: f32, height: usize) -> Self {
        let width = 2 * height;
        let fine = texels.height >= height && texels.width >= width;
        let texel = |x: usize, y: usize| {
            if fine {
                return texels.block_mean([x, y], [width, height], most).as_dvec3();
            }
            texels.at([(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32], most).as_dvec3()
        };
        let row = |y: usize| {
            let mut sum = DVec3::ZERO;
            let mut sums = vec![sum];
            sums.extend((0..width).map(|x| {
                sum += texel(x, y);
                sum
            }));
            sums
        };
        Self { width, height, sums: (0..height).into_par_iter().flat_map_iter(row).collect() }
    }

    /// The mean of row y between two places. The second is the right one, and at most one turn further.
    fn mean_between(&self, y: usize, from: f64, to: f64) -> DVec3 {
        let row = &self.sums[y * (self.width + 1)..][..=self.width];
        let up_to = |place: f64| {
            let (round, x) = (place.floor(), (place - place.floor()) * self.width as f64);
            let column = (x as usize).min(self.width - 1);
            row[self.width] * round + row[column] + (row[column + 1] - row[column]) * (x - column as f64)
        };
        (up_to(to) - up_to(from)) / ((to - from) * self.width as f64)
    }

    /// The mean over the directions within `half_angle` of the unit vector `towards`.
    fn cone_mean(&self, towards: DVec3, half_angle: f64) -> DVec3 {
        let (polar, across) = (towards.y.clamp(-1.0, 1.0).acos(), 0.5 + towards.z.atan2(towards.x) / TAU);
        let row = |angle: f64| (angle / PI * self.height as f64).clamp(0.0, self.height as f64);
        let (first, last) =
            (row(polar - half_angle) as usize, (row(polar + half_angle).ceil() as usize).min(self.height));
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for y in first..last {
            let there = PI * (y as f64 + 0.5) / self.height as f64;
            // The extent of the cone to both sides in this row.
            let cosine = (half_angle.cos() - polar.cos() * there.cos()) / (polar.sin() * there.sin()).max(1e-12);
            let reach = cosine.clamp(-1.0, 1.0).acos() / TAU;
            if reach > 0.0 {
                let area = reach * there.sin();
                sum += area * self.mean_between(y, across - reach, across + reach);
                weight += area;
            }
        }
        // The cone is narrower than a row and lies between two of them.
        if weight > 0.0 {
            sum / weight
        } else {
            self.mean_between((row(polar) as usize).min(self.height - 1), across, across + 1e-9)
        }
    }

    /// The cosine-weighted mean over the hemisphere about the unit vector `towards`.
    fn cosine_mean(&self, towards: DVec3) -> DVec3 {
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for y in 0..self.height {
            let solid_angle = super::solid_angle(self.width, self.height, y);
            for x in 0..self.width {
                let there = middle(x, y, [self.width, self.height]);
                let share = solid_angle * towards.dot(there).max(0.0);
                let (left, right) = (y * (self.width + 1) + x, y * (self.width + 1) + x + 1);
                sum += share * (self.sums[right] - self.sums[left]);
                weight += share;
            }
        }
        sum / weight
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::sky::tests::sky_of;

    /// The mean over a cone of half angle a of a function that is linear in the direction is (1 + cos a)/2 of the value
    /// along the axis; cosine-weighted over a hemisphere it is 2/3.
    #[test]
    fn levels_are_means_over_cones() {
        for height in [16, 50, 300] {
            let width = 2 * height;
            let slope = Vec3::new(0.7, 0.5, -0.6);
            let map = sky_of(width, height, |d| 1.0 + slope * d.as_vec3());
            assert_eq!(map.lights, [], "nothing is bright");
            let mut first = width * height;
            for level in 0..map.levels {
                let (across, down) = (2 * rows(level), rows(level));
                let words = &map.words[first..][..across * down];
                first += across * down;
                let half_angle = FRAC_PI_4 / f64::from(1 << (level.max(1) - 1));
                let share = if level == 0 { 2.0 / 3.0 } else { f64::midpoint(1.0, half_angle.cos()) };
                for (i, word) in words.iter().enumerate() {
                    let d = middle(i % across, i / across, [across, down]);
                    let expected = 1.0 + slope * d.as_vec3() * share as f32;
                    let off = (map.scale * super::super::unpack(*word) - expected).abs().max_element();
                    // The tolerance covers nine bits, 1/512 of at most 2, and the steps of rows, which have different
                    // heights after downsampling.
                    let most = if height < 64 { 0.02 } else { 0.01 };
                    assert!(off < most, "{height} rows, level {level}, {d}: off by {off}");
                }
            }
            assert_eq!(first, map.words.len());
        }
    }
}
