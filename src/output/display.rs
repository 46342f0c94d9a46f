//! From radiance to what a display shows: exposure, a tone curve, and 8-bit sRGB codes.
//!
//! Exposure multiplies radiance by 2^EV. The tone curve brings the product into [0, 1], and the codes are those of IEC
//! 61966-2-1, rounded to the nearest, without dithering.

use crate::color::srgb_from_linear;
use crate::settings::choices;

choices! {
    /// The curve that maps exposed radiance to displayable colours.
    #[derive(Default)]
    ToneMap {
        /// Troy Sobotka's AgX (2022) with its default look: bright light keeps its gradations and desaturates as on
        /// film, and dark colours stay saturated. 18 % grey stays near 18 %; white begins at 16.3.
        Agx = "agx",
        /// Khronos PBR Neutral (2024), made for products in uniform light: colours below 0.8 are kept, minus the 4 %
        /// that dielectrics reflect at normal incidence; brighter ones are compressed towards white.
        #[default]
        Neutral = "neutral",
        /// All channels divided by 1 + their luminance (Reinhard et al. 2002, equation 3, applied to the luminance),
        /// then clamped to 1.
        Reinhard = "reinhard",
        /// Clamped to 1.
        Linear = "linear",
    }
}

/// The display of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    pub tone: ToneMap,
    /// Exposure in stops: radiance is multiplied by 2^EV.
    pub exposure_ev: f32,
}

impl Display {
    /// The display of an image with its automatic exposure.
    pub fn automatic(tone: ToneMap, beauty: &[[f32; 3]]) -> Self {
        Self { tone, exposure_ev: tone.automatic_exposure(beauty) }
    }

    /// 8-bit sRGB of a radiance.
    pub fn codes(&self, radiance: [f32; 3]) -> [u8; 3] {
        let gain = self.exposure_ev.exp2();
        self.tone.apply(radiance.map(|c| c * gain)).map(srgb_code)
    }
}

/// The display-linear value that automatic exposure gives to the geometric mean of all pixels' luminance.
const SHOWN_MEAN: f32 = 0.18;
/// The display-linear value that it gives to the 95th percentile of the luminance.
const SHOWN_BRIGHT: f32 = 0.85;
/// The maximum for the 95th percentile of the pixels' largest channels: code 249 of 255.
const SHOWN_MOST: f32 = 0.945;

impl ToneMap {
    /// The automatic exposure of an image in EV, rounded to 0.01, so that the printed number gives the same bytes. It
    /// is EV = min((log₂(x₁₈ / g) + log₂(x₈₅ / b)) / 2, log₂(x₉₄ / c)). Here g is the geometric mean of the pixels'
    /// luminance, b its 95th percentile, and c the 95th percentile of the pixels' largest channels. The curve shows
    /// x₁₈, x₈₅ and x₉₄ as 0.18, 0.85 and 0.945. At most 5 % of the pixels therefore have a grey beyond code 249, and
    /// with `neutral` and `linear` also a channel. The sky counts. Black and non-finite pixels do not count, and the
    /// result is 0 if none is left. In the geometric mean each pixel counts for at least 2^−10 of the percentile.
    pub fn automatic_exposure(self, beauty: &[[f32; 3]]) -> f32 {
        let is_seen = |p: &&[f32; 3]| p.iter().all(|c| c.is_finite()) && luminance(**p) > 0.0;
        let seen: Vec<&[f32; 3]> = beauty.iter().filter(is_seen).collect();
        if seen.is_empty() {
            return 0.0;
        }
        // These are in stops: binary logarithms of radiance.
        let bright = percentile_95(seen.iter().map(|p| luminance(**p)).collect()).log2();
        let brightest_channel = percentile_95(seen.iter().map(|p| p[0].max(p[1]).max(p[2])).collect()).log2();
        let sum: f64 = seen.iter().map(|p| f64::from(luminance(**p).log2().max(bright - 10.0))).sum();
        let mean = (sum / seen.len() as f64) as f32;
        let most = self.stops_shown_as(SHOWN_MOST) - brightest_channel;
        let ev = 0.5 * (self.stops_shown_as(SHOWN_MEAN) - mean + self.stops_shown_as(SHOWN_BRIGHT) - bright);
        (ev.min(most) * 100.0).round() / 100.0
    }

    /// The binary logarithm of the grey that the curve shows as `linear`.
    fn stops_shown_as(self, linear: f32) -> f32 {
        let (mut below, mut above) = (-20.0f32, 20.0f32);
        for _ in 0..40 {
            let middle = 0.5 * (below + above);
            let is_darker = self.apply([middle.exp2(); 3])[1] < linear;
            *(if is_darker { &mut below } else { &mut above }) = middle;
        }
        below
    }

    /// The display-linear colour in [0, 1]³ of an exposed radiance; NaN becomes 0.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = rgb.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1e30) });
        match self {
            Self::Agx => agx(rgb),
            Self::Neutral => neutral(rgb),
            Self::Reinhard => {
                let scale = 1.0 / (1.0 + luminance(rgb));
                rgb.map(|c| (c * scale).min(1.0))
            }
            Self::Linear => rgb.map(|c| c.min(1.0)),
        }
    }
}

/// The 95th percentile, by the nearest rank. Not for an empty list.
pub(crate) fn percentile_95(mut values: Vec<f32>) -> f32 {
    let rank = ((values.len() - 1) as f64 * 0.95).round() as usize;
    *values.select_nth_unstable_by(rank, f32::total_cmp).1
}

/// If more than this share of an image is black, the image is reported.
pub const MOST_BLACK: f64 = 0.75;

/// The share of `pixels` that look black: no channel of their 8-bit code reaches 10.
pub fn black_share(pixels: &[&[f32; 3]], display: Display) -> f64 {
    let is_black = |p: &&&[f32; 3]| display.codes(***p).into_iter().all(|code| code < 10);
    pixels.iter().filter(is_black).count() as f64 / pixels.len().max(1) as f64
}

/// Rec. 709 luminance of linear radiance.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// The 8-bit sRGB code of a display-linear value in [0, 1].
pub fn srgb_code(linear: f32) -> u8 {
    (srgb_from_linear(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// Rows of the matrix that mixes the channels before the curve, and of its inverse.
const AGX_INSET: [[f32; 3]; 3] = [
    [0.842_479_06, 0.078_433_6, 0.079_223_745],
    [0.042_328_242, 0.878_468_64, 0.079_166_13],
    [0.042_375_655, 0.078_433_6, 0.879_143],
];
const AGX_OUTSET: [[f32; 3]; 3] = [
    [1.196_879, -0.098_020_88, -0.099_029_74],
    [-0.052_896_85, 1.151_903_1, -0.098_961_18],
    [-0.052_971_63, -0.098_043_45, 1.151_073_7],
];
/// Stops below and above 18 % grey that the curve covers.
const AGX_STOPS: [f32; 2] = [10.0, 6.5];

fn agx(rgb: [f32; 3]) -> [f32; 3] {
    let mix = |rows: [[f32; 3]; 3], c: [f32; 3]| rows.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2]);
    let curved = mix(AGX_INSET, rgb).map(|c| {
        let stops = (c.max(1e-10) / 0.18).log2();
        agx_curve(((stops + AGX_STOPS[0]) / (AGX_STOPS[0] + AGX_STOPS[1])).clamp(0.0, 1.0))
    });
    // The curve's values are codes of a display with exponent 2.2.
    mix(AGX_OUTSET, curved).map(|c| c.clamp(0.0, 1.0).powf(2.2))
}

/// AgX's sigmoid over the relative position in its stops: through (10/16.5, 0.5) with slope 2, to 0 and 1 at the ends.
fn agx_curve(x: f32) -> f32 {
    const SLOPE: f32 = 2.0;
    const MIDDLE: [f32; 2] = [AGX_STOPS[0] / (AGX_STOPS[0] + AGX_STOPS[1]), 0.5];
    // For the lower and the upper half: the distance to the end, its value, and the power of the bend.
    let (ends, power, sign) = if x < MIDDLE[0] { (MIDDLE, 3.0f32, -1.0) } else { (MIDDLE.map(|m| 1.0 - m), 3.25, 1.0) };
    // The scale is chosen so that the curve meets the end.
    let scale = ((SLOPE * ends[0]).powf(-power) * ((SLOPE * ends[0] / ends[1]).powf(power) - 1.0)).powf(-1.0 / power);
    let t = SLOPE * (x - MIDDLE[0]).abs() / scale;
    MIDDLE[1] + sign * scale * t / (1.0 + t.powf(power)).powf(1.0 / power)
}

/// Khronos Group, *PBR Neutral Tone Mapper*, 2024.
fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    const LEAST_REFLECTED: f32 = 0.04;
    const COMPRESS_FROM: f32 = 0.8 - LEAST_REFLECTED;
    const DESATURATION: f32 = 0.15;
    let least = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset =
        if least < 2.0 * LEAST_REFLECTED { least - least * least / (4.0 * LEAST_REFLECTED) } else { LEAST_REFLECTED };
    let rgb = rgb.map(|c| c - offset);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < COMPRESS_FROM {
        return rgb;
    }
    let room = 1.0 - COMPRESS_FROM;
    let compressed = 1.0 - room * room / (peak + room - COMPRESS_FROM);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    rgb.map(|c| {
        let scaled = c * (compressed / peak);
        scaled + (compressed - scaled) * white
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Benjamin Wrensch's polynomial (*Minimal AgX Implementation*, 2023) was fitted to the table of AgX with an error
    /// of .0019 (root mean square).
    #[test]
    fn the_curve_of_agx_is_that_of_its_table() {
        let polynomial = |x: f32| {
            let factors = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];
            factors.into_iter().fold(0.0, |sum, factor| sum * x + factor)
        };
        let square = |i: u32| (agx_curve(i as f32 / 1000.0) - polynomial(i as f32 / 1000.0)).powi(2);
        let rms = ((0..=1000).map(square).sum::<f32>() / 1001.0).sqrt();
        assert!(rms < 0.003, "{rms}");
        assert!(agx_curve(0.0).abs() < 1e-5 && (agx_curve(1.0) - 1.0).abs() < 1e-5);
    }
}
