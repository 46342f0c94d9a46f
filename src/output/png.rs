//! PNG files: exposure, tone curve, 8-bit sRGB.
//!
//! Exposure: radiance is multiplied by 2^EV. With automatic exposure the 95th percentile of the luminance without sky becomes
//! 0.8. EV is rounded to 0.01, so that the printed number gives the same bytes.
//!
//! Tone curve: "Khronos PBR Neutral" (Khronos Group, *PBR Neutral Tone Mapper*, 2024), made for glTF: colours below 0.8 are
//! kept (minus the 4 % that dielectrics reflect at normal incidence), brighter ones are compressed towards white.
//!
//! Encoding: IEC 61966-2-1, rounded to nearest, no dithering.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, RgbImage, RgbaImage};
use rayon::prelude::*;

use crate::color::srgb_from_linear;
use crate::layers::{Aov, Layers};
use crate::{Error, Result};

/// Rec. 709 luminance of linear radiance.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// The pixels that show something else than the radiance of the sky there, which `sky` tells of each pixel.
pub fn of_surfaces(beauty: &[[f32; 3]], sky: impl Fn(usize) -> [f32; 3]) -> impl Iterator<Item = &[f32; 3]> {
    // The image stores the sky in half floats, with 11 significant bits.
    const HALF_FLOAT: f32 = 1.0 / 1024.0;
    let is_sky = move |i: usize, p: &[f32; 3]| p.iter().zip(sky(i)).all(|(a, b)| (a - b).abs() <= HALF_FLOAT * b);
    beauty.iter().enumerate().filter(move |(i, p)| !is_sky(*i, p)).map(|(_, p)| p)
}

/// The automatic exposure of an image in EV, a multiple of 0.01. Pixels equal to the radiance of the sky there, which `sky` tells
/// of each pixel, black pixels and non-finite ones are ignored; 0 if none is left.
pub fn automatic_exposure(beauty: &[[f32; 3]], sky: impl Fn(usize) -> [f32; 3]) -> f32 {
    const PERCENTILE: f64 = 0.95;
    const TARGET: f32 = 0.8;
    let seen = of_surfaces(beauty, sky).map(|p| luminance(*p));
    let mut seen: Vec<f32> = seen.filter(|l| l.is_finite() && *l > 0.0).collect();
    if seen.is_empty() {
        return 0.0;
    }
    let rank = ((seen.len() - 1) as f64 * PERCENTILE).round() as usize;
    let (_, bright, _) = seen.select_nth_unstable_by(rank, f32::total_cmp);
    let ev = (TARGET / *bright).log2();
    (ev * 100.0).round() / 100.0
}

/// The display-linear colour in [0, 1]³ of an exposed radiance; NaN becomes 0.
pub fn tone_curve(rgb: [f32; 3]) -> [f32; 3] {
    const LEAST_REFLECTED: f32 = 0.04;
    const COMPRESS_FROM: f32 = 0.8 - LEAST_REFLECTED;
    const DESATURATION: f32 = 0.15;
    let rgb = rgb.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1e30) });
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

/// The 8-bit sRGB code of a display-linear value in [0, 1].
pub fn srgb_code(linear: f32) -> u8 {
    (srgb_from_linear(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// An image of which a larger share looks black hardly shows its scene.
pub const MOST_BLACK: f64 = 0.75;

/// The share of `pixels` that look black with this exposure: no channel of their 8-bit code reaches 10.
pub fn black_share(pixels: &[&[f32; 3]], exposure_ev: f32) -> f64 {
    let gain = exposure_ev.exp2();
    let is_black = |p: &&&[f32; 3]| tone_curve(p.map(|c| c * gain)).into_iter().all(|c| srgb_code(c) < 10);
    pixels.iter().filter(is_black).count() as f64 / pixels.len().max(1) as f64
}

/// The bytes of a PNG file of an exposed image; with alpha where it has such a layer.
pub fn encode(image: &Layers, exposure_ev: f32) -> Result<Vec<u8>> {
    let gain = exposure_ev.exp2();
    let shown = |p: &[f32; 3]| tone_curve(p.map(|c| c * gain)).map(srgb_code);
    let Some(alpha) = image.get(Aov::Alpha) else {
        let rgb: Vec<_> = image.beauty().par_iter().map(shown).collect();
        return encode_rgb(image.width, image.height, rgb.into_flattened());
    };
    // PNG's colours are not premultiplied.
    let pixel = |(p, alpha): (&[f32; 3], &[f32; 3])| {
        let covered = alpha[0].clamp(0.0, 1.0);
        let [r, g, b] = if covered > 0.0 { shown(&p.map(|c| c / covered)) } else { [0; 3] };
        [r, g, b, (covered * 255.0).round() as u8]
    };
    let rgba: Vec<_> = image.beauty().par_iter().zip(alpha).map(pixel).collect();
    encode_rgba(image.width, image.height, rgba.into_flattened())
}

/// The bytes of a PNG file: 8-bit RGBA without a colour space chunk.
pub fn encode_rgba(width: u32, height: u32, rgba: Vec<u8>) -> Result<Vec<u8>> {
    png_of(RgbaImage::from_raw(width, height, rgba).map(Into::into), width, height)
}

/// The bytes of a PNG file: 8-bit RGB without a colour space chunk, so viewers assume sRGB.
pub fn encode_rgb(width: u32, height: u32, rgb: Vec<u8>) -> Result<Vec<u8>> {
    png_of(RgbImage::from_raw(width, height, rgb).map(Into::into), width, height)
}

fn png_of(whole: Option<DynamicImage>, width: u32, height: u32) -> Result<Vec<u8>> {
    let failed = |why: String| Error::Usage(format!("an image of {width}x{height} pixels cannot be written: {why}"));
    let whole = whole.ok_or_else(|| failed("it has no pixels".to_owned()))?;
    let mut bytes = Cursor::new(Vec::new());
    whole.write_to(&mut bytes, ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(bytes.into_inner())
}

impl Layers {
    /// Writes the image to `path` as a PNG.
    pub fn write_png(&self, path: &Path, exposure_ev: f32) -> Result<()> {
        super::file::write(path, &encode(self, exposure_ev)?)
    }
}
