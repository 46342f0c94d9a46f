//! Image files for displays: PNG and JPEG in 8-bit sRGB without a colour space chunk, so that viewers assume sRGB.

use std::io::Cursor;
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageFormat, RgbImage, RgbaImage};
use rayon::prelude::*;

use super::display::Display;
use super::file;
use crate::layers::{Aov, Layers};
use crate::{Error, Result};

/// JPEG quality from 1 to 100: files have about a fifth of the PNG's size, without visible blocks.
const QUALITY: u8 = 95;

/// Kinds of image files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Linear radiance and layers.
    Exr,
    Png,
    Jpeg,
}

impl ImageKind {
    /// The kind by the ending of a file's name; PNG for standard output.
    pub fn of_path(path: &Path) -> Option<Self> {
        if file::is_standard(path) {
            return Some(Self::Png);
        }
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            _ => None,
        }
    }
}

/// The bytes of a PNG file, with alpha if the image has such a layer.
pub fn encode_png(image: &Layers, display: Display) -> Result<Vec<u8>> {
    let Some(alpha) = image.get(Aov::Alpha) else {
        return encode_rgb(image.width, image.height, codes(image.beauty(), display));
    };
    // PNG colours are not premultiplied.
    let pixel = |(p, alpha): (&[f32; 3], &[f32; 3])| {
        let covered = alpha[0].clamp(0.0, 1.0);
        let [r, g, b] = if covered > 0.0 { display.codes(p.map(|c| c / covered)) } else { [0; 3] };
        [r, g, b, (covered * 255.0).round() as u8]
    };
    let rgba: Vec<_> = image.beauty().par_iter().zip(alpha).map(pixel).collect();
    encode_rgba(image.width, image.height, rgba.into_flattened())
}

/// The bytes of a JPEG file. An alpha layer is left out.
pub fn encode_jpeg(image: &Layers, display: Display) -> Result<Vec<u8>> {
    let whole = RgbImage::from_raw(image.width, image.height, codes(image.beauty(), display));
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    let written = whole.filter(|image| !image.is_empty()).map(|image| image.write_with_encoder(encoder));
    match written {
        Some(Ok(())) => Ok(bytes),
        Some(Err(why)) => Err(cannot(image.width, image.height, &why.to_string())),
        None => Err(cannot(image.width, image.height, "it has no pixels")),
    }
}

/// 8-bit RGB of each pixel.
pub fn codes(radiance: &[[f32; 3]], display: Display) -> Vec<u8> {
    let rgb: Vec<_> = radiance.par_iter().map(|p| display.codes(*p)).collect();
    rgb.into_flattened()
}

/// The bytes of a PNG file: 8-bit RGBA.
pub fn encode_rgba(width: u32, height: u32, rgba: Vec<u8>) -> Result<Vec<u8>> {
    png_of(RgbaImage::from_raw(width, height, rgba).map(Into::into), width, height)
}

/// The bytes of a PNG file: 8-bit RGB.
pub fn encode_rgb(width: u32, height: u32, rgb: Vec<u8>) -> Result<Vec<u8>> {
    png_of(RgbImage::from_raw(width, height, rgb).map(Into::into), width, height)
}

fn png_of(whole: Option<DynamicImage>, width: u32, height: u32) -> Result<Vec<u8>> {
    let whole = whole.ok_or_else(|| cannot(width, height, "it has no pixels"))?;
    let mut bytes = Cursor::new(Vec::new());
    whole.write_to(&mut bytes, ImageFormat::Png).map_err(|e| cannot(width, height, &e.to_string()))?;
    Ok(bytes.into_inner())
}

fn cannot(width: u32, height: u32, why: &str) -> Error {
    Error::Usage(format!("an image of {width}x{height} pixels cannot be written: {why}"))
}

impl Layers {
    /// Writes the displayed image: a .png, or a .jpg by the path's ending.
    ///
    /// # Errors
    /// The path has another ending, or cannot be written.
    pub fn write_shown(&self, path: &Path, display: Display) -> Result<()> {
        let bytes = match ImageKind::of_path(path) {
            Some(ImageKind::Png) => encode_png(self, display)?,
            Some(ImageKind::Jpeg) => encode_jpeg(self, display)?,
            _ => return Err(Error::file(path, "has another ending than .png or .jpg; name it so")),
        };
        file::write(path, &bytes)
    }
}
