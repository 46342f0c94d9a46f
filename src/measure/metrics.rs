//! The definition of an image's error against its reference, which everything else uses: `energy rel relmse p95 flip`
//! of the whole image, and all except `flip` also of the indirect light, and of the indirect light on diffuse surfaces.
//! `docs/accuracy.md` has the formulas, and [`super::terms`] the settings with which the indirect light of a method is
//! measured.
//!
//! Pixels that are not finite in one of the images are counted and excluded from every metric.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::terms::{self, Subtract};
use crate::layers::{Aov, Layers};
use crate::output::exr::Metadata;
use crate::settings::choices;
use crate::{Error, Result};

/// The smallest denominator of a relative error, as a share of the reference's mean: for dark pixels.
const FLOOR: f64 = 0.01;

/// The least [`Aov::Diffuse`] of a wholly diffuse pixel: 1 up to rounding.
const WHOLLY_DIFFUSE: f32 = 0.999;

/// The luminance to which the reference's 95th percentile is exposed for FLIP.
const FLIP_WHITE: f32 = 0.8;

/// The metrics of one pair of images. Means are over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// mean(image) / mean(reference); ideally 1.
    pub energy: f64,
    /// mean |image − reference| / mean(reference).
    pub rel: f64,
    /// Mean over pixels of Σ (image − reference)² / (Σ reference² + 3 · 0.01 · mean(reference)²), Σ over channels.
    pub relmse: f64,
    /// 95th percentile over pixels of Σ |image − reference| / (Σ reference + 3 · 0.01 · mean(reference)).
    pub p95: f64,
}

choices! {
    /// A part of the light.
    Part {
        Total = "whole",
        Indirect = "indirect",
        /// Indirect, of pixels that show diffuse surfaces alone.
        Diffuse = "diffuse",
    }
}

/// A value for each part of the light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parts<T> {
    pub total: T,
    /// `None` if the reference has no indirect light, or it is not judged.
    pub indirect: Option<T>,
    /// `None` if there are no pixels with only diffuse surfaces, or no indirect light reaches them.
    pub diffuse: Option<T>,
}

impl<T: Copy> Parts<T> {
    pub fn of_part(&self, part: Part) -> Option<T> {
        match part {
            Part::Total => Some(self.total),
            Part::Indirect => self.indirect,
            Part::Diffuse => self.diffuse,
        }
    }
}

/// Counts of non-finite values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NonFinite {
    pub nan: usize,
    pub inf: usize,
}

/// The comparison of an image with its reference.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    pub total: Metrics,
    /// Mean of [`Self::flip_map`].
    pub flip: f64,
    /// Metrics of the indirect light: the images minus the direct light that [`Subtract`] selects. `None` without the
    /// required layers, and if the reference has no indirect light.
    pub indirect: Option<Metrics>,
    /// Metrics of the indirect light over the pixels in which the reference shows only diffuse surfaces, neither
    /// metallic nor transmitting. `None` if it has no diffuse layer, no such pixels, or no indirect light in them.
    pub indirect_diffuse: Option<Metrics>,
    /// LDR-FLIP per pixel, 0 to 1, at 67 pixels per degree, after exposing and clamping both images.
    #[serde(skip)]
    pub flip_map: Vec<f32>,
    /// The factor on both images for FLIP.
    #[serde(skip)]
    pub exposure: f32,
    #[serde(rename = "image_nonfinite")]
    pub image: NonFinite,
    #[serde(rename = "reference_nonfinite")]
    pub reference: NonFinite,
}

impl Metrics {
    pub const NAMES: [&str; 4] = ["energy", "rel", "relmse", "p95"];

    /// In the order of [`Self::NAMES`], for the Python package.
    pub fn values(&self) -> [f64; 4] {
        [self.energy, self.rel, self.relmse, self.p95]
    }
}

impl NonFinite {
    pub fn of_pixels(pixels: &[[f32; 3]]) -> Self {
        let values = pixels.iter().flatten();
        Self { nan: values.clone().filter(|v| v.is_nan()).count(), inf: values.filter(|v| v.is_infinite()).count() }
    }

    pub fn count(&self) -> usize {
        self.nan + self.inf
    }
}

/// Compares two images of the same size. `subtract` selects the direct light that is subtracted to leave the indirect
/// light.
///
/// # Errors
/// [`Error::Usage`] for different sizes, an image without finite pixels and a black reference.
pub fn compare(image: &Layers, reference: &Layers, subtract: Subtract) -> Result<Comparison> {
    let [size, other] = [image, reference].map(|layers| format!("{}x{}", layers.width, layers.height));
    if size != other {
        let text = format!("the image is {size}, the reference {other}; render both at the same size");
        return Err(Error::Usage(text));
    }
    for (what, layers) in [("image", image), ("reference", reference)] {
        if layers.beauty().iter().all(|p| !finite(p)) {
            return Err(Error::Usage(format!("the {what} has no finite pixel; render it again")));
        }
    }
    let total = metrics(image.beauty(), reference.beauty(), "reference")?;
    let direct = match subtract {
        Subtract::Own => image.get(Aov::Direct),
        Subtract::OfReference => reference.get(Aov::Direct),
    };
    let parts = direct.map(|direct| difference(image.beauty(), direct)).zip(indirect(reference));
    let of_diffuse = |(image, light): &(Vec<[f32; 3]>, Vec<[f32; 3]>)| {
        let shares = reference.get(Aov::Diffuse)?;
        let pick = |pixels: &[[f32; 3]]| -> Vec<_> {
            pixels.iter().zip(shares).filter(|(_, share)| share[0] >= WHOLLY_DIFFUSE).map(|(p, _)| *p).collect()
        };
        metrics(&pick(image), &pick(light), "reference").ok()
    };
    let exposure = exposure(reference.beauty());
    let flip_map = flip(image, reference, exposure);
    Ok(Comparison {
        total,
        flip: flip_map.iter().map(|&f| f as f64).sum::<f64>() / flip_map.len() as f64,
        indirect_diffuse: parts.as_ref().and_then(of_diffuse),
        // Without indirect light in the reference there is no relative error.
        indirect: parts.and_then(|(a, b)| metrics(&a, &b, "reference's indirect part").ok()),
        flip_map,
        exposure,
        image: NonFinite::of_pixels(image.beauty()),
        reference: NonFinite::of_pixels(reference.beauty()),
    })
}

/// [`compare`] for images with the headers of their files; an image of another program has no entries in its header.
/// Also returns the settings with which the image must be rendered again before its indirect light can be compared;
/// empty if it can be.
///
/// # Errors
/// As for [`compare`].
pub fn compare_files(image: &Layers, reference: &Layers, headers: [&Metadata; 2]) -> Result<(Comparison, String)> {
    let no_sky = Vec3::ZERO.to_string();
    let has_sky = headers.iter().any(|header| header.get("sky").is_some_and(|sky| *sky != no_sky));
    let subtract = if has_sky { Subtract::OfReference } else { Subtract::Own };
    let mut comparison = compare(image, reference, subtract)?;
    let needs = headers[0].get(terms::HEADER).cloned().unwrap_or_default();
    if !needs.is_empty() {
        (comparison.indirect, comparison.indirect_diffuse) = (None, None);
    }
    Ok((comparison, needs))
}

/// The noise that a reference's own error may add to `rel`, for each part of the light: mean |error of the reference|
/// over its mean. For the indirect light it is the whole light's noise, which is no smaller. `error` is the expected
/// error of every pixel of the reference. By the triangle inequality no image's `rel` differs by more from that against
/// a reference without noise. Because the noise has zero mean, it increases `rel`, apart from chance that averages out
/// over the pixels.
pub fn noise_in_rel(reference: &Layers, error: &[[f32; 3]]) -> Parts<f64> {
    let sum = |pixels: &[[f32; 3]], counts: &dyn Fn(usize) -> bool| -> f64 {
        let counted = pixels.iter().enumerate().filter(|(i, p)| finite(p) && counts(*i));
        counted.flat_map(|(_, p)| p).map(|v| f64::from(*v)).sum()
    };
    let sizes: Vec<[f32; 3]> = error.iter().map(|p| p.map(f32::abs)).collect();
    let share = |light: &[[f32; 3]], counts: &dyn Fn(usize) -> bool| {
        let (noise, light) = (sum(&sizes, counts), sum(light, counts));
        (light > 0.0).then_some(noise / light)
    };
    let (all, indirect) = (|_: usize| true, indirect(reference));
    let diffuse = reference.get(Aov::Diffuse);
    let is_diffuse = |i: usize| diffuse.is_some_and(|layer| layer[i][0] >= WHOLLY_DIFFUSE);
    Parts {
        total: share(reference.beauty(), &all).unwrap_or_default(),
        indirect: indirect.as_ref().and_then(|light| share(light, &all)),
        diffuse: indirect.as_ref().and_then(|light| share(light, &is_diffuse)),
    }
}

/// The image minus its own direct layer; `None` without one.
fn indirect(layers: &Layers) -> Option<Vec<[f32; 3]>> {
    Some(difference(layers.beauty(), layers.get(Aov::Direct)?))
}

fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<[f32; 3]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| a[c] - b[c])).collect()
}

fn finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

/// The values of a pixel in the image and in the reference.
type Pair = ([f64; 3], [f64; 3]);

/// The metrics of `image` against `reference`, pixel by pixel; `what` names the reference in the error for a black one.
pub fn metrics(image: &[[f32; 3]], reference: &[[f32; 3]], what: &str) -> Result<Metrics> {
    let pairs = image.iter().zip(reference).filter(|(a, b)| finite(a) && finite(b));
    let pairs: Vec<Pair> = pairs.map(|(a, b)| (a.map(f64::from), b.map(f64::from))).collect();
    let values = 3.0 * pairs.len() as f64;
    let mean = pairs.iter().flat_map(|(_, b)| b).sum::<f64>() / values;
    if mean.is_nan() || mean <= 0.0 {
        return Err(Error::Usage(format!("the {what} is black, so relative errors are undefined; light the scene")));
    }
    let differences = |(a, b): &Pair, power: i32| (0..3).map(|c| (a[c] - b[c]).abs().powi(power)).sum::<f64>();
    let squared = |pair: &Pair| {
        let square: f64 = pair.1.iter().map(|v| v * v).sum();
        differences(pair, 2) / (square + 3.0 * FLOOR * mean * mean)
    };
    let relative = |pair: &Pair| differences(pair, 1) / (pair.1.iter().sum::<f64>() + 3.0 * FLOOR * mean);
    Ok(Metrics {
        energy: pairs.iter().flat_map(|(a, _)| a).sum::<f64>() / values / mean,
        rel: pairs.iter().map(|pair| differences(pair, 1)).sum::<f64>() / values / mean,
        relmse: pairs.iter().map(squared).sum::<f64>() / pairs.len() as f64,
        p95: percentile(pairs.iter().map(relative).collect(), 0.95),
    })
}

/// The percentile by linear interpolation between ranks (Hyndman and Fan's type 7, NumPy's default); 0 without values.
fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let rank = share * last as f64;
    let (below, part) = (rank as usize, rank.fract());
    values[below] + (values[(below + 1).min(last)] - values[below]) * part
}

/// The factor by which the 95th percentile of the reference's luminance becomes 0.8; 1 for a black reference.
fn exposure(reference: &[[f32; 3]]) -> f32 {
    let luminance =
        reference.iter().filter(|p| finite(p)).map(|p| f64::from(crate::output::display::luminance(*p))).collect();
    let white = percentile(luminance, 0.95) as f32;
    if white > 0.0 { FLIP_WHITE / white } else { 1.0 }
}

/// 8-bit sRGB after multiplication by `exposure`, clamped; non-finite pixels are black.
fn exposed(pixels: &[[f32; 3]], exposure: f32) -> Vec<u8> {
    let code = |v: f32| crate::output::display::srgb_code((v * exposure).clamp(0.0, 1.0));
    pixels.iter().flat_map(|p| if finite(p) { p.map(code) } else { [0; 3] }).collect()
}

/// NVIDIA's FLIP per pixel (nv-flip, the authors' C++ code).
fn flip(image: &Layers, reference: &Layers, exposure: f32) -> Vec<f32> {
    let ldr = |l: &Layers| nv_flip::FlipImageRgb8::with_data(l.width, l.height, &exposed(l.beauty(), exposure));
    nv_flip::flip(ldr(reference), ldr(image), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec()
}
