//! Exact sums of samples per pixel: threads, interruptions and the order of parts do not change a bit.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::integrator::Sample;
use super::sum::{SmallSum, Sum};
use crate::layers::{Aov, Layers, relative_noise};

/// Sums over one pixel's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Three sums each: radiance of even samples, of odd samples, direct light. Then one: metres to the surfaces that
    /// samples hit.
    sums: [Sum; 10],
    /// Samples that hit a surface.
    hits: u64,
    /// Normal, albedo, ambient occlusion, diffuse share.
    small: [SmallSum; 8],
}

const DIRECT: usize = 6;
const DEPTH: usize = 9;
const ALBEDO: usize = 3;
const OCCLUSION: usize = 6;
const DIFFUSE: usize = 7;

/// A row of pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelRow {
    /// Samples per pixel so far.
    pub done: u32,
    /// Non-finite samples, which count as black.
    pub rejected: u64,
    pub pixels: Vec<Pixel>,
}

/// The state of an unfinished or finished reference image.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub width: u32,
    /// The number of the first sample: 0 unless the film is a part for a merge.
    pub first: u32,
    /// Rows from the top.
    pub rows: Vec<PixelRow>,
    /// (samples per pixel, noise) at each count of [`next_check`] that all rows reached.
    pub history: Vec<(u32, f64)>,
}

/// The next number of samples after `done` at which noise is estimated. From 16 on, there are eight such numbers
/// between 2ⁿ and 2ⁿ⁺¹.
pub fn next_check(done: u32) -> u32 {
    const FIRST: u32 = 16;
    if done < FIRST {
        return FIRST;
    }
    let step = (1 << done.ilog2()) / 8;
    (done / step + 1) * step
}

impl Pixel {
    /// Adds sample number `index`. `depth` is in metres.
    pub fn add(&mut self, sample: &Sample, index: u32, depth: f64) {
        let mut add = |at: usize, values: &[f32]| {
            self.sums[at..].iter_mut().zip(values).for_each(|(sum, value)| sum.add((*value).into()));
        };
        add(3 * (index as usize & 1), sample.beauty.as_ref());
        add(DIRECT, sample.direct.as_ref());
        let mut add = |at: usize, values: &[f32]| {
            self.small[at..].iter_mut().zip(values).for_each(|(sum, value)| sum.add((*value).into()));
        };
        add(OCCLUSION, &[sample.ao, sample.diffuse]);
        if let Some(first) = &sample.first {
            add(0, first.normal.as_ref());
            add(ALBEDO, first.albedo.as_ref());
            self.sums[DEPTH].add(depth);
            self.hits += 1;
        }
    }

    /// Adds the sums of other samples.
    fn unite(&mut self, other: &Self) {
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, other)| sum.unite(other));
        self.small.iter_mut().zip(other.small).for_each(|(sum, other)| sum.unite(other));
        self.hits += other.hits;
    }

    #[inline]
    fn sum(&self, at: usize) -> DVec3 {
        DVec3::new(self.sums[at].get(), self.sums[at + 1].get(), self.sums[at + 2].get())
    }

    fn small(&self, at: usize) -> DVec3 {
        DVec3::new(self.small[at].get(), self.small[at + 1].get(), self.small[at + 2].get())
    }

    fn beauty(&self, samples: f64) -> DVec3 {
        (self.sum(0) + self.sum(3)) / samples
    }

    /// Half the difference of the even and the odd samples' images.
    fn error(&self, samples: f64) -> DVec3 {
        (self.sum(0) - self.sum(3)) / samples
    }

    fn layer(&self, aov: Aov, samples: f64) -> [f32; 3] {
        let direct = || self.sum(DIRECT) / samples;
        let value = match aov {
            Aov::Beauty => self.beauty(samples),
            Aov::Alpha => DVec3::splat(self.hits as f64 / samples),
            Aov::Direct => direct(),
            Aov::Indirect => self.beauty(samples) - direct(),
            Aov::Ao => DVec3::splat(self.small[OCCLUSION].get() / samples),
            Aov::Normal => self.small(0).as_vec3().normalize_or_zero().as_dvec3(),
            Aov::Depth if self.hits == 0 => DVec3::INFINITY,
            Aov::Depth => DVec3::splat(self.sums[DEPTH].get() / self.hits as f64),
            Aov::Albedo => self.small(ALBEDO) / samples,
            Aov::Diffuse => DVec3::splat(self.small[DIFFUSE].get() / samples),
        };
        value.as_vec3().to_array()
    }
}

impl Film {
    pub fn new(width: u32, height: u32) -> Self {
        let row = PixelRow { pixels: vec![Pixel::default(); width as usize], ..PixelRow::default() };
        Self { width, first: 0, rows: vec![row; height as usize], history: Vec::new() }
    }

    /// Bytes of memory for a film and its copy while it is saved.
    pub fn bytes(width: u32, height: u32) -> u64 {
        2 * width as u64 * height as u64 * size_of::<Pixel>() as u64
    }

    /// Samples per pixel of the row with the fewest.
    pub fn done(&self) -> u32 {
        self.rows.iter().map(|r| r.done).min().unwrap_or(0)
    }

    /// Samples per pixel of the row with the most.
    pub fn started(&self) -> u32 {
        self.rows.iter().map(|r| r.done).max().unwrap_or(0)
    }

    /// Samples of all pixels together.
    pub fn paths(&self) -> u64 {
        self.rows.iter().map(|r| r.done as u64 * self.width as u64).sum()
    }

    /// Adds the samples that follow this film's own, of the same image. The bits are those of one film with all
    /// samples.
    pub fn unite(&mut self, next: &Self) {
        for (row, other) in self.rows.iter_mut().zip(&next.rows) {
            row.done += other.done;
            row.rejected += other.rejected;
            row.pixels.iter_mut().zip(&other.pixels).for_each(|(pixel, other)| pixel.unite(other));
        }
        // Noise in between was not estimated.
        self.history.clear();
    }

    /// The number of non-finite samples, which count as black.
    pub fn rejected(&self) -> u64 {
        self.rows.iter().map(|r| r.rejected).sum()
    }

    /// The expected relative error of the image against a converged one, as root mean square over pixels. The error is
    /// estimated as half the difference of the images of even and odd samples. [`relative_noise`] has the formula.
    pub fn noise(&self) -> f64 {
        let samples = self.done() as f64;
        let pixel = |p: &Pixel| (p.beauty(samples), p.error(samples));
        relative_noise(self.rows.iter().flat_map(|r| &r.pixels).map(pixel))
    }

    /// The expected error of every pixel, by the same estimate: radiance, signed.
    pub fn error(&self) -> Vec<[f32; 3]> {
        let samples = self.done().max(1) as f64;
        let pixel = |p: &Pixel| p.error(samples).as_vec3().to_array();
        self.rows.iter().flat_map(|r| &r.pixels).map(pixel).collect()
    }

    /// Metadata of an .exr: the samples per pixel and the noise.
    pub fn header(&self) -> [(String, String); 2] {
        let (samples, noise) = (self.done().to_string(), format!("{:.6}", self.noise()));
        [("samplesPerPixel".to_owned(), samples), ("noise".to_owned(), noise)]
    }

    /// The image and further layers. All rows must have the same number of samples.
    pub fn layers(&self, aovs: &[Aov]) -> Layers {
        let samples = self.done().max(1) as f64;
        let layer = |&aov: &Aov| {
            let pixels = self.rows.iter().flat_map(|r| &r.pixels).map(|p| p.layer(aov, samples)).collect();
            (aov, pixels)
        };
        let further = aovs.iter().filter(|a| **a != Aov::Beauty);
        let layers = std::iter::once(&Aov::Beauty).chain(further).map(layer).collect();
        Layers { width: self.width, height: self.rows.len() as u32, layers }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_come_in_steps_of_an_eighth() {
        let mut counts = vec![next_check(0)];
        while counts.len() < 11 {
            counts.push(next_check(*counts.last().unwrap_or(&0)));
        }
        assert_eq!(counts, [16, 18, 20, 22, 24, 26, 28, 30, 32, 36, 40]);
        assert_eq!([1, 15, 17, 23, 31, 47].map(next_check), [16, 16, 18, 24, 32, 48]);
    }

    #[test]
    fn noise_is_half_the_difference_of_even_and_odd_samples() {
        let mut film = Film::new(1, 1);
        for (index, value) in [(0, 1.2f32), (1, 0.8)] {
            let sample = Sample { beauty: glam::Vec3::splat(value), ..Sample::default() };
            film.rows[0].pixels[0].add(&sample, index, 0.0);
            film.rows[0].done += 1;
        }
        // The image is 1, and the halves are 1.2 and 0.8; the floor adds 1 % to the square of the value.
        assert!((film.noise() - 0.2 / 1.01f64.sqrt()).abs() < 1e-6, "{}", film.noise());
    }
}
