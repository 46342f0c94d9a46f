//! Pictures small enough to be embedded in a page.

use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};

use crate::{Error, Result};

/// Pixels that the longer side of an embedded picture has at most.
const LONGEST: u32 = 384;

/// Out of 100; edges in renderings show blocks much below.
const QUALITY: u8 = 90;

/// A JPEG file of an 8-bit sRGB image of `size` pixels, made smaller where it is large.
pub fn jpeg(size: (u32, u32), rgb: Vec<u8>) -> Result<Vec<u8>> {
    let failed = |why: String| Error::Usage(format!("a picture for the page cannot be made: {why}"));
    let mut picture =
        image::RgbImage::from_raw(size.0, size.1, rgb).ok_or_else(|| failed("it has the wrong size".into()))?;
    let longer = size.0.max(size.1);
    if longer > LONGEST {
        let [width, height] = [size.0, size.1].map(|side| (side * LONGEST).div_ceil(longer));
        picture = resize(&picture, width, height, FilterType::Triangle);
    }
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY).encode_image(&picture).map_err(|e| failed(e.to_string()))?;
    Ok(bytes)
}

/// A JPEG file as a URI that holds it.
pub fn data_uri(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", base64(jpeg))
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(group.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= group.len() { letter.into() } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_encodes_the_vectors_of_rfc_4648() {
        let vectors =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (bytes, text) in vectors {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn large_pictures_are_made_smaller_and_keep_their_shape() {
        let size = |width: u32, height: u32| {
            let bytes = jpeg((width, height), vec![99; (3 * width * height) as usize]).unwrap();
            let picture = image::load_from_memory(&bytes).unwrap();
            (picture.width(), picture.height())
        };
        assert_eq!(size(64, 48), (64, 48));
        assert_eq!(size(1536, 768), (384, 192));
        assert_eq!(size(16384, 1), (384, 1));
    }
}
