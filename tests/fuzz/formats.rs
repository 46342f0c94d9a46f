//! Lengths and checksums of a file, corrected after a change, so that readers go past them.

use std::ops::Range;

use serde_json::Value;

use crate::bytes::{self, MOST_BYTES};
use crate::json;
use crate::random::Random;

/// A change of a file with this ending. `other`: another file.
pub fn change(random: &mut Random, ending: &str, file: &[u8], other: &[u8]) -> Vec<u8> {
    // Some changes leave wrong headers and checksums, so that these are tested too.
    let plain = random.below(8) == 0;
    let mut out = file.to_vec();
    match ending {
        "glb" if !plain => {
            if let Some(changed) = glb(random, file, other) {
                return changed;
            }
        }
        "gltf" | "json" if !plain => {
            if let Ok(mut document) = serde_json::from_slice(file) {
                json::change(random, &mut document);
                return document.to_string().into_bytes();
            }
        }
        "toml" | "row" | "outline" if !plain && random.below(2) == 0 => {
            if let Some(changed) = toml_text(random, file) {
                return changed;
            }
        }
        _ => {}
    }
    let all = 0..out.len();
    // Headers determine how the rest is read.
    let part = if random.below(4) == 0 { 0..out.len().min(128) } else { all };
    bytes::change(random, &mut out, part, other);
    match ending {
        "png" if !plain => mend_png(&mut out),
        "film" if !plain => mend_film(&mut out),
        "part" if !plain => mend_part(&mut out),
        _ => {}
    }
    out
}

/// Changes names and values of a TOML text; `None` where the result is not TOML.
fn toml_text(random: &mut Random, file: &[u8]) -> Option<Vec<u8>> {
    let mut document: Value = toml::from_str(std::str::from_utf8(file).ok()?).ok()?;
    json::change(random, &mut document);
    toml::to_string(&document).ok().map(String::into_bytes)
}

/// Changes the document, the content of a buffer view, or any byte of the binary chunk.
fn glb(random: &mut Random, file: &[u8], other: &[u8]) -> Option<Vec<u8>> {
    let (mut document, mut binary) = split(file)?;
    match random.below(5) {
        0..2 => json::change(random, &mut document),
        2..4 if !binary.is_empty() => {
            let views = views(&document, binary.len());
            let part = if views.is_empty() { 0..binary.len() } else { views[random.below(views.len())].clone() };
            bytes::change(random, &mut binary, part, other);
        }
        _ => {
            json::change(random, &mut document);
            let all = 0..binary.len();
            bytes::change(random, &mut binary, all, other);
        }
    }
    // A change that moved bytes made the stated length wrong.
    if random.below(4) > 0
        && let Some(length) = document.pointer_mut("/buffers/0/byteLength")
        && length.as_u64().is_some_and(|length| length > binary.len() as u64)
    {
        *length = binary.len().into();
    }
    let out = join(&document, &binary);
    (out.len() <= MOST_BYTES).then_some(out)
}

/// The document and the binary chunk of a valid file.
pub fn split(glb: &[u8]) -> Option<(Value, Vec<u8>)> {
    let word = |at: usize| Some(u32::from_le_bytes(glb.get(at..at + 4)?.try_into().ok()?) as usize);
    let end = 20usize.checked_add(word(12)?)?;
    let document = serde_json::from_slice(glb.get(20..end)?).ok()?;
    let binary = word(end).and_then(|length| glb.get(end + 8..end.checked_add(8)?.checked_add(length)?));
    Some((document, binary.unwrap_or_default().to_vec()))
}

pub fn join(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let words = |words: [usize; 3]| words.map(|word| (word as u32).to_le_bytes()).concat();
    let head = [2, 28 + text.len() + binary.len(), text.len()];
    [b"glTF", &words(head)[..], b"JSON", &text, &(binary.len() as u32).to_le_bytes(), b"BIN\0", &binary].concat()
}

/// The ranges of the binary chunk with the content of buffer views and of compressed ones.
fn views(document: &Value, length: usize) -> Vec<Range<usize>> {
    let number = |value: &Value, key: &str| value.get(key).and_then(Value::as_u64).unwrap_or(0) as usize;
    let range = |value: &Value| {
        let start = number(value, "byteOffset").min(length);
        start..start.saturating_add(number(value, "byteLength")).min(length)
    };
    let stated = document["bufferViews"].as_array().into_iter().flatten();
    let ranges = stated.flat_map(|view| {
        let compressed = view["extensions"].as_object().into_iter().flat_map(|extensions| extensions.values());
        std::iter::once(range(view)).chain(compressed.map(range))
    });
    ranges.filter(|range| !range.is_empty()).collect()
}

/// Corrects the checksums of all chunks.
fn mend_png(png: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = png.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_be_bytes) {
        let end = at + 8 + length as usize;
        let Some(sum) = png.get(at + 4..end).map(crc) else { return };
        let Some(slot) = png.get_mut(end..end + 4) else { return };
        slot.copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}

/// The checksum of PNG (ISO 3309), bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

/// A film ends with the hash of all bytes before it.
fn mend_film(film: &mut [u8]) {
    if let Some((content, hash)) = film.split_last_chunk_mut::<32>() {
        *hash = *blake3::hash(content).as_bytes();
    }
}

/// A part of a film holds its film after a text and the text's length.
fn mend_part(part: &mut [u8]) {
    let length = part.get(8..12).and_then(|bytes| bytes.try_into().ok()).map_or(0, u32::from_le_bytes) as usize;
    if let Some(film) = part.get_mut(length.saturating_add(12)..) {
        mend_film(film);
    }
}
