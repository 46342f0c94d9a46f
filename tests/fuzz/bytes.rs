//! Changes of bytes without regard to their meaning.

use std::ops::Range;

use crate::random::Random;

/// The largest size of an input, because fuzzing concerns small files.
pub const MOST_BYTES: usize = 64 << 10;

/// Numbers at the limits of types and of the counts of formats.
pub const WHOLE: [u64; 18] = [
    0,
    1,
    2,
    3,
    16,
    127,
    128,
    255,
    256,
    32767,
    65535,
    65536,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 40,
    i64::MAX as u64,
    u64::MAX,
];

/// Changes up to eight places of a part of the bytes; some changes move the bytes behind it. `other`: another input,
/// from which parts are copied.
pub fn change(random: &mut Random, bytes: &mut Vec<u8>, part: Range<usize>, other: &[u8]) {
    for _ in 0..random.few() {
        let part = part.start.min(bytes.len())..part.end.min(bytes.len());
        if part.is_empty() {
            return;
        }
        once(random, bytes, part, other);
    }
    bytes.truncate(MOST_BYTES);
}

fn once(random: &mut Random, bytes: &mut Vec<u8>, part: Range<usize>, other: &[u8]) {
    let at = part.start + random.below(part.len());
    match random.below(16) {
        0..3 => bytes[at] ^= 1 << random.below(8),
        3..5 => bytes[at] = random.below(256) as u8,
        5 => bytes[at] = bytes[at].wrapping_add(random.below(9) as u8).wrapping_sub(4),
        6..9 => number(random, bytes, at),
        9 => {
            // A run becomes one byte.
            let end = (at + 1 + random.below(64)).min(part.end);
            let byte = [0, 0xff, bytes[at]][random.below(3)];
            bytes[at..end].fill(byte);
        }
        10..12 => {
            // A part is copied over another.
            let from = part.start + random.below(part.len());
            let length = (1 + random.below(32)).min(part.end - at).min(part.end - from);
            bytes.copy_within(from..from + length, at);
        }
        12 => {
            let end = (at + 1 + random.below(32)).min(part.end);
            bytes.drain(at..end);
        }
        13 => {
            let end = (at + 1 + random.below(32)).min(part.end);
            let twice = bytes[at..end].to_vec();
            bytes.splice(at..at, twice);
        }
        14 if !other.is_empty() => {
            let from = random.below(other.len());
            let length = (1 + random.below(64)).min(other.len() - from).min(part.end - at);
            bytes[at..at + length].copy_from_slice(&other[from..from + length]);
        }
        14 => {}
        _ if random.below(4) == 0 => bytes.truncate(at),
        _ => digits(random, bytes, at),
    }
}

/// Writes a number of two, four or eight bytes in either order, or adds to the present one.
fn number(random: &mut Random, bytes: &mut [u8], at: usize) {
    let width = [1, 2, 4, 4, 8][random.below(5)].min(bytes.len() - at);
    let slot = &mut bytes[at..at + width];
    let mut value = [0; 8];
    value[..width].copy_from_slice(slot);
    let known = u64::from_le_bytes(value);
    let new = match random.below(3) {
        0 => known.wrapping_add(random.below(16) as u64).wrapping_sub(8),
        1 => known.wrapping_mul(1 << random.below(17)),
        _ => WHOLE[random.below(WHOLE.len())],
    };
    slot.copy_from_slice(&new.to_le_bytes()[..width]);
    if random.below(3) == 0 {
        slot.reverse();
    }
}

/// Replaces a number that is written in digits, the first one from `at` on.
fn digits(random: &mut Random, bytes: &mut Vec<u8>, at: usize) {
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|n| at + n) else { return };
    let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit()).count();
    let words =
        ["0", "1", "-1", "1.0", "1e9", "1e400", "4294967295", "18446744073709551616", "nan", "inf", "\"\"", "[]"];
    let text = words[random.below(words.len())].bytes();
    bytes.splice(start..start + length, text);
}
