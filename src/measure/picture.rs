//! Comparison pictures.

use super::metrics::Comparison;
use crate::Result;
use crate::layers::Layers;
use crate::output::display::{Display, ToneMap};
use crate::output::picture::{codes, encode_rgb};

/// The relative difference that is shown in full colour.
const FULL_COLOR: f32 = 0.25;

/// A PNG with four panels side by side: image, reference, signed difference (red: too bright, blue: too dark), and FLIP
/// in the colours of magma. The images have the automatic exposure of the reference.
pub fn side_by_side(image: &Layers, reference: &Layers, comparison: &Comparison) -> Result<Vec<u8>> {
    let (width, height) = (image.width as usize, image.height as usize);
    let display = Display::automatic(ToneMap::default(), reference.beauty());
    let panels = [
        codes(image.beauty(), display),
        codes(reference.beauty(), display),
        signed_difference(image.beauty(), reference.beauty()),
        magma(&comparison.flip_map, image.width, image.height),
    ];
    let row = |y: usize| panels.iter().flat_map(move |panel| &panel[3 * width * y..3 * width * (y + 1)]);
    let pixels = (0..height).flat_map(row).copied().collect();
    encode_rgb(4 * image.width, image.height, pixels)
}

/// RGB per pixel: white where the images are equal, red where the image is brighter, blue where it is darker.
pub fn signed_difference(image: &[[f32; 3]], reference: &[[f32; 3]]) -> Vec<u8> {
    let sum = |p: &[f32; 3]| p.iter().filter(|v| v.is_finite()).sum::<f32>();
    let floor = 0.01 * reference.iter().map(sum).sum::<f32>() / reference.len() as f32;
    let color = |(a, b): (&[f32; 3], &[f32; 3])| {
        let difference = (sum(a) - sum(b)) / (sum(b) + floor) / FULL_COLOR;
        let fade = 255 - (difference.abs() * 255.0).min(255.0) as u8;
        if difference > 0.0 { [255, fade, fade] } else { [fade, fade, 255] }
    };
    image.iter().zip(reference).flat_map(color).collect()
}

fn magma(flip: &[f32], width: u32, height: u32) -> Vec<u8> {
    nv_flip::FlipImageFloat::with_data(width, height, flip).apply_color_lut(&nv_flip::magma_lut()).to_vec()
}
