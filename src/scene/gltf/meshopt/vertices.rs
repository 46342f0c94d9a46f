//! Attributes (appendix A, mode 0), versions 0 and 1: differences between consecutive elements, apart by bytes.

use super::{Damage, Stream};

/// Elements whose differences share a number of bits.
const GROUP: usize = 16;
/// Bytes and elements of a block.
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;

/// Bits of a difference by a group's two header bits, for version 0 and for the two control modes of version 1 that have them.
const BITS_0: [u32; 4] = [0, 2, 4, 8];
const BITS_1: [[u32; 4]; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// `count` elements of `stride` bytes, which is a multiple of four up to 256.
pub fn decode(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Damage> {
    let mut stream = Stream(bytes);
    let (version, tail) = match stream.byte()? {
        0xa0 => (0, stride.max(32)),
        0xa1 => (1, (stride + stride / 4).max(24)),
        _ => return Err("are of an unknown version"),
    };
    let tail = stream.tail(tail)?;
    let (channels, tail) = match version {
        0 => (vec![Channel::Bytes; stride / 4], tail),
        _ => {
            let (tail, modes) = tail.split_at(tail.len() - stride / 4);
            (modes.iter().map(|mode| Channel::new(*mode)).collect::<Result<_, _>>()?, tail)
        }
    };
    let mut last = tail[tail.len() - stride..].to_vec();
    let mut out = Vec::new();
    let most = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_ELEMENTS);
    // Columns of a block: all first bytes of its elements, all second bytes, ...
    let mut columns = vec![0; stride * BLOCK_ELEMENTS];
    let mut left = count;
    while left > 0 {
        let elements = left.min(most);
        let controls = stream.take(if version == 0 { 0 } else { stride / 4 })?;
        for (number, column) in columns.chunks_exact_mut(BLOCK_ELEMENTS).enumerate() {
            let control = controls.get(number / 4).map(|byte| byte >> (2 * (number % 4)) & 3);
            match control {
                None => read_groups(&mut stream, BITS_0, &mut column[..elements.next_multiple_of(GROUP)])?,
                Some(2) => column[..elements].fill(0),
                Some(3) => column[..elements].copy_from_slice(stream.take(elements)?),
                Some(mode) => {
                    let column = &mut column[..elements.next_multiple_of(GROUP)];
                    read_groups(&mut stream, BITS_1[usize::from(mode)], column)?;
                }
            }
        }
        for element in 0..elements {
            for (number, channel) in channels.iter().enumerate() {
                let difference = std::array::from_fn(|i| columns[(4 * number + i) * BLOCK_ELEMENTS + element]);
                let value: &mut [u8; 4] = last[4 * number..].first_chunk_mut().ok_or(super::ENDS_EARLY)?;
                *value = channel.next(*value, difference);
            }
            out.extend_from_slice(&last);
        }
        left -= elements;
    }
    stream.end()?;
    Ok(out)
}

/// Reads groups of 16 differences with a common header: two bits a group, which choose among `bits`.
fn read_groups(stream: &mut Stream, bits: [u32; 4], column: &mut [u8]) -> Result<(), Damage> {
    let header = stream.take((column.len() / GROUP).div_ceil(4))?;
    for (number, group) in column.chunks_exact_mut(GROUP).enumerate() {
        let bits = bits[usize::from(header[number / 4] >> (2 * (number % 4)) & 3)];
        match bits {
            0 => group.fill(0),
            8 => group.copy_from_slice(stream.take(GROUP)?),
            _ => read_group(stream, bits, group)?,
        }
    }
    Ok(())
}

/// Differences of 1, 2 or 4 bits. All bits set say that a whole byte after the group has the difference.
fn read_group(stream: &mut Stream, bits: u32, group: &mut [u8]) -> Result<(), Damage> {
    let packed = stream.take(GROUP * bits as usize / 8)?;
    let (in_byte, sentinel) = (8 / bits as usize, (1u8 << bits) - 1);
    for (i, slot) in group.iter_mut().enumerate() {
        // Single bits are packed from the lowest one on, pairs and quadruples from the highest.
        let place = if bits == 1 { i % in_byte } else { in_byte - 1 - i % in_byte };
        *slot = packed[i / in_byte] >> (place * bits as usize) & sentinel;
    }
    for slot in group.iter_mut().filter(|slot| **slot == sentinel) {
        *slot = stream.byte()?;
    }
    Ok(())
}

/// How four bytes follow from the same four of the element before.
#[derive(Clone, Copy)]
enum Channel {
    Bytes,
    /// Two numbers of 16 bits.
    Words,
    /// Bits that differ, rotated to the left by so many.
    Xor(u32),
}

impl Channel {
    fn new(mode: u8) -> Result<Self, Damage> {
        match (mode & 15, mode >> 4) {
            (0, 0) => Ok(Self::Bytes),
            (1, 0) => Ok(Self::Words),
            (2, rotation) => Ok(Self::Xor(rotation.into())),
            _ => Err("have a channel of an unknown mode"),
        }
    }

    fn next(self, last: [u8; 4], difference: [u8; 4]) -> [u8; 4] {
        match self {
            Self::Bytes => {
                let signed = |v: u8| (v >> 1) ^ (v & 1).wrapping_neg();
                std::array::from_fn(|i| last[i].wrapping_add(signed(difference[i])))
            }
            Self::Words => {
                let [a, b, c, d] = last;
                let [e, f, g, h] = difference;
                let signed = |v: u16| (v >> 1) ^ (v & 1).wrapping_neg();
                let next = |last, v| u16::from_le_bytes(last).wrapping_add(signed(u16::from_le_bytes(v))).to_le_bytes();
                let ([a, b], [c, d]) = (next([a, b], [e, f]), next([c, d], [g, h]));
                [a, b, c, d]
            }
            Self::Xor(rotation) => {
                let changed = u32::from_le_bytes(difference).rotate_right(rotation);
                (u32::from_le_bytes(last) ^ changed).to_le_bytes()
            }
        }
    }
}
