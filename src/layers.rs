//! A rendered image and its auxiliary layers, linear, in float32. [`crate::output::exr`] reads and writes them.

use glam::DVec3;

use crate::settings::choices;

choices! {
    /// A layer of an image ("arbitrary output variable"), in the order of files. Its name is used in flags and before
    /// the OpenEXR channels.
    Aov {
        /// Radiance: the image itself.
        Beauty = "beauty",
        /// Share of the pixel that surfaces cover; three equal channels. OpenEXR's channel A, and with it colours are
        /// premultiplied.
        Alpha = "alpha",
        /// Radiance of emission and direct light.
        Direct = "direct",
        /// Radiance of all other light: beauty − direct.
        Indirect = "indirect",
        /// Ambient occlusion: 1 is unoccluded, 0 is fully occluded; three equal channels.
        Ao = "ao",
        /// Shading normal in world space, unit length on surfaces.
        Normal = "normal",
        /// Distance along the view's forward axis in metres, +∞ on the sky; three equal channels.
        Depth = "depth",
        /// The surface's base colour.
        Albedo = "albedo",
        /// Share of the surface that is neither metallic nor transmitting, 0 to 1: (1 − metallic) · (1 − transmission).
        /// 0 on the sky and on unlit surfaces; three equal channels.
        Diffuse = "diffuse",
    }
}

/// An image with its layers. Rows from the top, `width · height` pixels each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    pub width: u32,
    pub height: u32,
    /// [`Aov::Beauty`] is always first.
    pub layers: Vec<(Aov, Vec<[f32; 3]>)>,
}

impl Layers {
    /// An image with one layer.
    pub fn new(width: u32, height: u32, beauty: Vec<[f32; 3]>) -> Self {
        Self { width, height, layers: vec![(Aov::Beauty, beauty)] }
    }

    /// The pixels of one layer; `None` if it is absent.
    pub fn get(&self, aov: Aov) -> Option<&[[f32; 3]]> {
        self.layers.iter().find(|(a, _)| *a == aov).map(|(_, pixels)| pixels.as_slice())
    }

    /// The image itself; empty if absent.
    pub fn beauty(&self) -> &[[f32; 3]] {
        self.get(Aov::Beauty).unwrap_or_default()
    }
}

/// The mean of passes over one image, each with other ray directions.
#[derive(Default)]
#[cfg_attr(not(internals), doc(hidden))]
pub struct PassMean {
    passes: u32,
    /// Sums over all passes, as [`Layers`].
    sums: Vec<(Aov, Vec<DVec3>)>,
    /// Sums of [`Aov::Beauty`] over the passes with an even index.
    even: Vec<DVec3>,
    size: (u32, u32),
}

impl PassMean {
    pub fn add(&mut self, pass: &Layers) {
        if self.passes == 0 {
            self.size = (pass.width, pass.height);
            self.sums = pass.layers.iter().map(|(aov, pixels)| (*aov, vec![DVec3::ZERO; pixels.len()])).collect();
            self.even = vec![DVec3::ZERO; pass.beauty().len()];
        }
        let add = |sums: &mut [DVec3], pixels: &[[f32; 3]]| {
            sums.iter_mut().zip(pixels).for_each(|(sum, pixel)| *sum += DVec3::from(pixel.map(f64::from)));
        };
        self.sums.iter_mut().zip(&pass.layers).for_each(|((_, sums), (_, pixels))| add(sums, pixels));
        if self.passes.is_multiple_of(2) {
            add(&mut self.even, pass.beauty());
        }
        self.passes += 1;
    }

    pub fn passes(&self) -> u32 {
        self.passes
    }

    pub fn layers(&self) -> Layers {
        let passes = f64::from(self.passes.max(1));
        let mean = |sum: &DVec3| (*sum / passes).as_vec3().to_array();
        let layer = |(aov, sums): &(Aov, Vec<DVec3>)| (*aov, sums.iter().map(mean).collect());
        Layers { width: self.size.0, height: self.size.1, layers: self.sums.iter().map(layer).collect() }
    }

    /// The estimated noise of the mean, as [`relative_noise`]: the error is taken as half the difference between the
    /// means of even and odd passes. `None` for a single pass.
    pub fn noise(&self) -> Option<f64> {
        let beauty = self.sums.iter().find(|(aov, _)| *aov == Aov::Beauty).filter(|_| self.passes > 1)?;
        let (all, even) = (f64::from(self.passes), f64::from(self.passes.div_ceil(2)));
        let pixel = |(sum, even_sum): (&DVec3, &DVec3)| {
            (*sum / all, 0.5 * (*even_sum / even - (*sum - *even_sum) / (all - even)))
        };
        Some(relative_noise(beauty.1.iter().zip(&self.even).map(pixel)))
    }
}

/// Root mean square over pixels of relative errors, defined as in `relmse`: per pixel √(Σ error² / (Σ value² + 3ε))
/// with ε = 0.01 · mean(values)². `pixels` yields value and error of each pixel in linear radiance. 0 for a black
/// image.
#[cfg_attr(not(internals), doc(hidden))]
pub fn relative_noise(pixels: impl Iterator<Item = (DVec3, DVec3)> + Clone) -> f64 {
    let n = pixels.clone().count() as f64;
    let mean = pixels.clone().map(|(value, _)| value.element_sum()).sum::<f64>() / (3.0 * n);
    if mean <= 0.0 || mean.is_nan() {
        return 0.0;
    }
    let floor = 0.03 * mean * mean;
    let relative = pixels.map(|(value, error)| error.length_squared() / (value.length_squared() + floor));
    (relative.sum::<f64>() / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_and_its_noise_are_closed_forms() {
        let pass = |value: f32| Layers {
            width: 2,
            height: 1,
            layers: vec![(Aov::Beauty, vec![[value; 3]; 2]), (Aov::Depth, vec![[f32::INFINITY; 3], [3.0; 3]])],
        };
        let mut mean = PassMean::default();
        mean.add(&pass(1.25));
        assert_eq!((mean.noise(), mean.layers()), (None, pass(1.25)));
        mean.add(&pass(0.75));
        // The mean is 1, the halves are off by 0.25; the floor adds 0.01.
        let noise = mean.noise().expect("two passes");
        assert!((noise - 0.25 / 1.01f64.sqrt()).abs() < 1e-6, "{noise}");
        mean.add(&pass(1.25));
        mean.add(&pass(0.75));
        assert_eq!((mean.noise(), mean.layers()), (Some(noise), pass(1.0)));
    }
}
