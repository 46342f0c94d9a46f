//! Images in KTX 2 containers: KHR_texture_basisu's ETC1S (BasisLZ) or UASTC, plain or with zstd, and plain texels
//! (`plain`).
//!
//! The container's header and index are read here (KTX File Format 2.0, sections 3 to 5) and checked against the file.
//! Then the crate `basisu` decodes the largest level. Smaller levels are generated.

mod plain;

use std::ops::Range;

use basisu::{DecodeFlags, TargetFormat, Transcoder};

/// The first bytes of every file of version 2.
const IDENTIFIER: &[u8; 12] = b"\xABKTX 20\xBB\r\n\x1A\n";
/// Colour models of a data format descriptor (Khronos Data Format 1.4, 5.6).
const ETC1S: u8 = 163;
const UASTC: u8 = 166;
/// Supercompression schemes (3.9).
const NONE: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTD: u32 = 2;
const ZLIB: u32 = 3;
/// Bytes of the header, and of an entry of the index of levels after it.
const HEADER: usize = 80;
const LEVEL: usize = 24;
/// Position of the offset and length of the key/value data in the header.
const KEY_VALUES: Range<usize> = 56..64;
/// Bytes at the start of BasisLZ's global data, and of each following entry of a level (5.1).
const GLOBAL: usize = 20;
/// The window that a frame of zstd may use in any case: the size that the format recommends decoders to support.
const WINDOW_MAX: u64 = 8 << 20;
/// Bytes of a data format descriptor with one sample, and with a second one for alpha.
const DESCRIPTORS: [usize; 2] = [44, 60];

/// Whether `bytes` are a KTX 2 file.
pub fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(IDENTIFIER)
}

/// The size of the largest level in texels.
/// The error is the end of a sentence, for unsupported formats and for parts outside the file.
pub fn size(bytes: &[u8]) -> Result<(u32, u32), &'static str> {
    let header = bytes.get(..HEADER).ok_or("ends within its header")?;
    let [format, width, height, depth] = [12, 20, 24, 28].map(|at| word(header, at));
    let [layers, faces, levels, scheme] = [32, 36, 40, 44].map(|at| word(header, at));
    // Plain texels without levels ask the reader to generate them; the file has the largest one.
    let levels = if format != 0 && levels == 0 { 1 } else { levels };
    if width == 0 || height == 0 || depth != 0 || layers > 1 || faces != 1 || !(1..=16).contains(&levels) {
        return Err("is no image of two dimensions");
    }
    let index = bytes.get(HEADER..HEADER + LEVEL * levels as usize).ok_or("ends within its header")?;
    let level = part(bytes, long(index, 0), long(index, 8)).ok_or("ends within its largest level")?;
    if format != 0 {
        plain_level(bytes)?.check()?;
        return Ok((width, height));
    }
    let descriptor = part(bytes, word(header, 48).into(), word(header, 52).into());
    let descriptor = descriptor.filter(|d| DESCRIPTORS.contains(&d.len())).ok_or("has no data format descriptor")?;
    // Blocks of 4 × 4 texels, 16 bytes each in UASTC.
    let blocks = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4));
    let fits = match (descriptor[12], scheme) {
        (UASTC, NONE) => level.len() as u64 >= 16 * blocks,
        // The decoder gets as many bytes as the index states.
        (UASTC, ZSTD) => {
            if window(level).is_some_and(|window| window > WINDOW_MAX.max(16 * blocks)) {
                return Err("has a largest level that asks for more memory than it holds");
            }
            long(index, 16) == 16 * blocks
        }
        (ETC1S, BASIS_LZ) => {
            let global = part(bytes, long(header, 64), long(header, 72)).ok_or("ends within its global data")?;
            let with_alpha = descriptor.len() == DESCRIPTORS[1];
            slices_fit(global, level, levels as usize, with_alpha).ok_or("ends within its global data")?
        }
        (ETC1S | UASTC, _) => return Err("is supercompressed in a way that its format excludes"),
        _ => return Err("holds texels that are not in Basis Universal's formats"),
    };
    if fits { Ok((width, height)) } else { Err("has a largest level of another size than its header states") }
}

/// The window of a zstd frame, which decoders must keep (RFC 8878, 3.1.1.1); `None` if it is the whole content.
fn window(frame: &[u8]) -> Option<u64> {
    let (descriptor, window) = (*frame.get(4)?, *frame.get(5)?);
    let single_segment = descriptor & 0x20 != 0;
    let base = 1u64 << (10 + (window >> 3));
    (!single_segment).then_some(base + base / 8 * u64::from(window & 7))
}

/// Whether the largest level holds its slices, of colours and of alpha; `None` if the global data end before their own
/// parts.
fn slices_fit(global: &[u8], level: &[u8], levels: usize, with_alpha: bool) -> Option<bool> {
    let entries = global.get(GLOBAL..GLOBAL * (1 + levels))?;
    // Codebooks of endpoints and selectors, and tables.
    let parts: u64 = [4, 8, 12].map(|at| u64::from(word(global, at))).iter().sum();
    part(global, (GLOBAL * (1 + levels)) as u64, parts)?;
    let slice = |at: usize| part(level, word(entries, at).into(), word(entries, at + 4).into()).is_some();
    Some(slice(4) && (!with_alpha || slice(12)))
}

/// The largest level of a file whose [`size`] is known, in plain texels.
/// The error is the end of a sentence, for other formats.
fn plain_level(bytes: &[u8]) -> Result<plain::PlainLevel<'_>, &'static str> {
    let [number, width, height, scheme] = [12, 20, 24, 44].map(|at| word(bytes, at));
    let format = plain::format(number).ok_or("holds texels that are not of 8 or 16 bits a channel")?;
    let index = &bytes[HEADER..];
    let level = part(bytes, long(index, 0), long(index, 8)).ok_or("ends within its largest level")?;
    let (width, height) = (width as usize, height as usize);
    Ok(plain::PlainLevel { format, width, height, scheme, bytes: level, stated: long(index, 16) })
}

/// The largest level: 8-bit RGBA, rows from the top, 4 · width · height bytes of the [`size`]; and whether it has 16
/// bits a channel. The error is the end of a sentence, for damaged data.
pub fn decode(bytes: &[u8]) -> Result<(Vec<u8>, bool), &'static str> {
    size(bytes)?;
    if word(bytes, 12) != 0 {
        let level = plain_level(bytes)?;
        let data = part(bytes, word(bytes, KEY_VALUES.start).into(), word(bytes, KEY_VALUES.start + 4).into());
        let shown = plain::DisplayForm::parse(data.unwrap_or_default());
        return Ok((level.rgba(&shown)?, level.is_deep()));
    }
    // Key/value data are not used, and basisu 0.1.0 reads beyond damaged ones.
    let mut bytes = bytes.to_vec();
    bytes[KEY_VALUES].fill(0);
    let image = Transcoder::new(&bytes).map_err(|_| "has damaged tables")?;
    let rgba =
        image.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(|_| "has a damaged largest level")?;
    Ok((rgba, false))
}

/// A part of a file; `None` if it extends outside.
fn part(bytes: &[u8], at: u64, length: u64) -> Option<&[u8]> {
    bytes.get(usize::try_from(at).ok()?..usize::try_from(at.checked_add(length)?).ok()?)
}

/// The number at a place that is known to exist.
fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

fn long(bytes: &[u8], at: usize) -> u64 {
    u64::from(word(bytes, at)) | u64::from(word(bytes, at + 4)) << 32
}
