//! Filters (appendix B), which convert each decoded element to the form that accessors read.
//!
//! Elements outside the ranges that the extension allows give unspecified numbers, as the extension says, and no error:
//! the reader of the elements checks them.

use std::f32::consts::FRAC_1_SQRT_2;

/// Replaces every element of `N` numbers with `B` bytes each.
fn for_each<const B: usize, const N: usize>(bytes: &mut [u8], replace: impl Fn([[u8; B]; N]) -> [[u8; B]; N]) {
    for element in bytes.chunks_exact_mut(N * B) {
        let read = std::array::from_fn(|i| std::array::from_fn(|j| element[B * i + j]));
        element.chunks_exact_mut(B).zip(replace(read)).for_each(|(slot, number)| slot.copy_from_slice(&number));
    }
}

/// Octahedral filter for unit vectors of 8 bits per component; the fourth number stays.
pub fn octahedral_8(bytes: &mut [u8]) {
    for_each(bytes, |[x, y, one, w]| {
        let [x, y, z] = octahedral([x, y, one].map(|b| f32::from(i8::from_le_bytes(b))), 127.0);
        [(x as i8).to_le_bytes(), (y as i8).to_le_bytes(), (z as i8).to_le_bytes(), w]
    });
}

/// Octahedral filter for components of 16 bits.
pub fn octahedral_16(bytes: &mut [u8]) {
    for_each(bytes, |[x, y, one, w]| {
        let [x, y, z] = octahedral([x, y, one].map(|b| f32::from(i16::from_le_bytes(b))), 32767.0);
        [(x as i16).to_le_bytes(), (y as i16).to_le_bytes(), (z as i16).to_le_bytes(), w]
    });
}

/// `one` represents 1 in the input, and `max` in the result.
fn octahedral([x, y, one]: [f32; 3], max: f32) -> [f32; 3] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded over the edges of the upper one.
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| (v / length * max).round())
}

/// Unit quaternions without their largest component. Its number is in the lowest two bits of the last number.
pub fn quaternion(bytes: &mut [u8]) {
    for_each(bytes, |element| {
        let [x, y, z, last] = element.map(i16::from_le_bytes);
        let one = f32::from(last | 3);
        let [x, y, z] = [x, y, z].map(|v| f32::from(v) / one * FRAC_1_SQRT_2);
        let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let mut out = [[0; 2]; 4];
        for (step, value) in [largest, x, y, z].into_iter().enumerate() {
            out[(usize::from(last as u16 & 3) + step) % 4] = ((value * 32767.0).round() as i16).to_le_bytes();
        }
        out
    });
}

/// Floats from a signed exponent in the highest 8 bits and a signed mantissa in the others. The result is exact, even
/// if the power of two does not exist in f32.
pub fn exponential(bytes: &mut [u8]) {
    for_each(bytes, |[number]| {
        let number = i32::from_le_bytes(number);
        let (exponent, mantissa) = (number >> 24, number << 8 >> 8);
        [((2f64.powi(exponent) * f64::from(mantissa)) as f32).to_le_bytes()]
    });
}

/// Colours as luma, two chromas and alpha, with 8 bits per component.
pub fn color_8(bytes: &mut [u8]) {
    for_each(bytes, |[y, co, cg, a]| {
        let chroma = |b| i32::from(i8::from_le_bytes(b));
        let rgba = color([i32::from(y[0]), chroma(co), chroma(cg), i32::from(a[0])], 255.0);
        rgba.map(|v| (v as u8).to_le_bytes())
    });
}

/// Colour filter for components of 16 bits.
pub fn color_16(bytes: &mut [u8]) {
    for_each(bytes, |[y, co, cg, a]| {
        let chroma = |b| i32::from(i16::from_le_bytes(b));
        let plain = |b| i32::from(u16::from_le_bytes(b));
        color([plain(y), chroma(co), chroma(cg), plain(a)], 65535.0).map(|v| (v as u16).to_le_bytes())
    });
}

/// Alpha has one bit less than the other components, below a bit that marks their number of bits. `max` represents 1 in
/// the result.
fn color([y, co, cg, a]: [i32; 4], max: f32) -> [f32; 4] {
    let one = (1 << (a.checked_ilog2().unwrap_or(0) + 1)) - 1;
    let alpha = a & (one >> 1);
    let scale = max / one as f32;
    [y + co - cg, y + cg, y - co - cg, alpha << 1 | alpha & 1].map(|v| (v as f32 * scale).round())
}
