//! Small pictures that are embedded in a page.

use base64::prelude::{BASE64_STANDARD, Engine};
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};

/// The maximum of the longer side of an embedded picture in pixels.
const LONGEST: u32 = 384;

/// JPEG quality out of 100; edges in renderings show blocks at much lower values.
const QUALITY: u8 = 90;

/// A URI with an 8-bit sRGB image of `size` pixels as a JPEG file, which is reduced if it is large.
pub fn uri(size: (u32, u32), rgb: Vec<u8>) -> String {
    format!("data:image/jpeg;base64,{}", BASE64_STANDARD.encode(jpeg(size, rgb)))
}

fn jpeg(size: (u32, u32), rgb: Vec<u8>) -> Vec<u8> {
    let mut picture = RgbImage::from_raw(size.0, size.1, rgb).expect("three bytes a pixel");
    let longer = size.0.max(size.1);
    if longer > LONGEST {
        let [width, height] = [size.0, size.1].map(|side| (side * LONGEST).div_ceil(longer));
        picture = resize(&picture, width, height, FilterType::Triangle);
    }
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    encoder.encode_image(&picture).expect("memory takes every byte, and the picture is small");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_pictures_are_made_smaller_and_keep_their_shape() {
        let size = |width: u32, height: u32| {
            let bytes = jpeg((width, height), vec![99; (3 * width * height) as usize]);
            let picture = image::load_from_memory(&bytes).unwrap();
            (picture.width(), picture.height())
        };
        assert_eq!(size(64, 48), (64, 48));
        assert_eq!(size(1536, 768), (384, 192));
        assert_eq!(size(16384, 1), (384, 1));
    }
}
