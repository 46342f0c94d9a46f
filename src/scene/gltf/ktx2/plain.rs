//! Plain texels of 8 or 16 bits a channel (KTX File Format 2.0, 3.1: `vkFormat`), uncompressed or compressed by zstd or
//! zlib.

use std::borrow::Cow;
use std::io::Read;

use super::{NONE, WINDOW_MAX, ZLIB, ZSTD, window};

/// Names of channels in the order of their bytes, and bytes of each.
#[derive(Clone, Copy)]
pub struct Format {
    channels: &'static str,
    bytes: usize,
}

/// The format with Vulkan's number; `None` unless it has channels of 8 or 16 bits that represent 0 to 1, without
/// blocks.
pub fn format(number: u32) -> Option<Format> {
    let (channels, bytes) = match number {
        9 | 15 => ("r", 1),
        16 | 22 => ("rg", 1),
        23 | 29 => ("rgb", 1),
        30 | 36 => ("bgr", 1),
        // The second pair is packed: red is its lowest byte.
        37 | 43 | 51 | 57 => ("rgba", 1),
        44 | 50 => ("bgra", 1),
        70 => ("r", 2),
        77 => ("rg", 2),
        84 => ("rgb", 2),
        91 => ("rgba", 2),
        _ => return None,
    };
    Some(Format { channels, bytes })
}

/// Input of the decoder: one level of plain texels.
pub struct PlainLevel<'a> {
    pub format: Format,
    pub width: usize,
    pub height: usize,
    pub scheme: u32,
    /// The stored bytes.
    pub bytes: &'a [u8],
    /// The size in bytes of the uncompressed level, as stated by the index.
    pub stated: u64,
}

/// The display of texels according to the key/value data (3.11): the source of each channel, which is a channel of the
/// file or 0 or 1, and whether columns begin on the right and rows at the bottom.
pub struct DisplayForm {
    pub swizzle: [u8; 4],
    pub mirrored: [bool; 2],
}

impl PlainLevel<'_> {
    fn stride(&self) -> usize {
        self.format.channels.len() * self.format.bytes
    }

    fn size(&self) -> usize {
        self.width.saturating_mul(self.height).saturating_mul(self.stride())
    }

    /// Refuses a level whose size does not match its texels.
    /// The error is the end of a sentence.
    pub fn check(&self) -> Result<(), &'static str> {
        let (size, largest_window) = (self.size() as u64, WINDOW_MAX.max(self.size() as u64));
        let fits = match self.scheme {
            NONE => self.bytes.len() as u64 == size,
            ZSTD if window(self.bytes).is_some_and(|window| window > largest_window) => {
                return Err("has a largest level that asks for more memory than it holds");
            }
            ZSTD | ZLIB => self.stated == size,
            _ => return Err("is supercompressed in a way that its format excludes"),
        };
        if fits { Ok(()) } else { Err("has a largest level of another size than its header states") }
    }

    /// The uncompressed texels; `None` for damaged data.
    fn texels(&self) -> Option<Cow<'_, [u8]>> {
        let texels = match self.scheme {
            ZSTD => {
                let mut decoder = ruzstd::StreamingDecoder::new(self.bytes).ok()?;
                filled(self.size(), |to| ruzstd::io::Read::read(&mut decoder, to).ok())?
            }
            ZLIB => {
                let mut decoder = flate2::read::ZlibDecoder::new(self.bytes);
                filled(self.size(), |to| decoder.read(to).ok())?
            }
            _ => return Some(self.bytes.into()),
        };
        Some(texels.into())
    }

    /// 8-bit RGBA, rows from the top; 16 bits are rounded.
    /// The error is the end of a sentence, for damaged data.
    pub fn rgba(&self, shown: &DisplayForm) -> Result<Vec<u8>, &'static str> {
        let texels = self.texels().ok_or("has a damaged largest level")?;
        let Format { channels, bytes } = self.format;
        // The place of each channel in a texel. Missing colours are 0, and missing alpha is 1.
        let places = shown.swizzle.map(|name| channels.bytes().position(|channel| channel == name));
        let absent = shown.swizzle.map(|name| if matches!(name, b'1' | b'a') { 255 } else { 0 });
        let value = |texel: &[u8], place: usize| match bytes {
            1 => texel[place],
            _ => {
                let wide = u32::from(u16::from_le_bytes([texel[2 * place], texel[2 * place + 1]]));
                ((wide * 255 + 32767) / 65535) as u8
            }
        };
        let [from_right, from_below] = shown.mirrored;
        let mut rgba = Vec::with_capacity(4 * self.width * self.height);
        for y in 0..self.height {
            let row = if from_below { self.height - 1 - y } else { y };
            for x in 0..self.width {
                let column = if from_right { self.width - 1 - x } else { x };
                let texel = &texels[(row * self.width + column) * self.stride()..];
                rgba.extend((0..4).map(|c| places[c].map_or(absent[c], |place| value(texel, place))));
            }
        }
        Ok(rgba)
    }

    /// Whether the conversion to 8 bits loses precision.
    pub fn is_deep(&self) -> bool {
        self.format.bytes > 1
    }
}

/// Exactly `size` bytes from a decoder, which returns how many it wrote; `None` if it ends before.
fn filled(size: usize, mut read: impl FnMut(&mut [u8]) -> Option<usize>) -> Option<Vec<u8>> {
    let (mut bytes, mut count) = (vec![0; size], 0);
    while count < size {
        count += read(&mut bytes[count..]).filter(|more| *more > 0)?;
    }
    Some(bytes)
}

impl DisplayForm {
    /// Reads key/value data; damaged or unknown entries are ignored.
    pub fn parse(mut data: &[u8]) -> Self {
        let mut shown = Self { swizzle: *b"rgba", mirrored: [false; 2] };
        while let Some((length, rest)) = data.split_at_checked(4) {
            let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
            let Some(entry) = rest.get(..length) else { break };
            let mut parts = entry.split(|b| *b == 0);
            let (key, value) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
            match (key, value) {
                (b"KTXswizzle", &[r, g, b, a]) if [r, g, b, a].iter().all(|c| b"rgba01".contains(c)) => {
                    shown.swizzle = [r, g, b, a];
                }
                (b"KTXorientation", &[across, down, ..]) => shown.mirrored = [across == b'l', down == b'u'],
                _ => {}
            }
            // Entries begin at multiples of four.
            data = rest.get(length.next_multiple_of(4)..).unwrap_or_default();
        }
        shown
    }
}
