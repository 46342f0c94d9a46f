//! OpenEXR files: linear float32, channels `R G B` for the image, `A` for its coverage, `direct.R` … for further layers; text in the header.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use exr::meta::MetaData;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers, Text,
    WritableImage,
};

use super::read;
use crate::error::said;
use crate::layers::{Aov, Layers};
use crate::{Error, Result};

/// Header entries by name. Names have at most 31 bytes; values are UTF-8.
pub type Metadata = BTreeMap<String, String>;

impl Layers {
    /// Writes the layers to `path`.
    pub fn write_exr(&self, path: &Path, metadata: &Metadata) -> Result<()> {
        let bytes = encode(self, metadata).map_err(|e| Error::file(path, format!("cannot be written: {e}")))?;
        crate::output::file::write(path, &bytes)
    }

    /// Reads R G B, all layers of [`Aov`] in the file, and the text in its header.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn read_exr(path: &Path) -> Result<(Self, Metadata)> {
        let length = read::about(path, "an OpenEXR image")?.len();
        let check_memory = |bytes: u64| read::check_memory(path, bytes, "image");
        let mut file = File::open(path).map_err(|e| read::unreadable(path, &e))?;
        let meta = MetaData::read_from_unbuffered(&mut file, false);
        let meta = meta.map_err(|e| Error::file(path, unreadable(&e)))?;
        // Of one channel. Every part may state what no machine counts.
        let pixels = meta.headers.iter().map(|header| header.layer_size.area() as u64);
        let pixels = pixels.fold(0, u64::saturating_add);
        let channels = meta.headers.iter().map(|header| header.channels.list.len() as u64).max().unwrap_or(0);
        let values = pixels.saturating_mul(channels);
        // As read, and as layers.
        check_memory(values.saturating_mul(8))?;
        read::check_length(path, values <= length.saturating_mul(VALUES_MAX))?;
        // What is behind the pixels is not read.
        file.rewind().map_err(|e| read::unreadable(path, &e))?;
        decode_from(BufReader::new(file)).map_err(|problem| Error::file(path, problem))
    }
}

/// Values of a channel that a byte holds at most: deflate makes 1032 bytes of one, and a value has two.
const VALUES_MAX: u64 = 1032 / 2;

fn unreadable(e: &exr::error::Error) -> String {
    format!("is not a readable OpenEXR image: {}", said(e))
}

/// The bytes of an OpenEXR file.
pub fn encode(image: &Layers, metadata: &Metadata) -> exr::error::Result<Vec<u8>> {
    let mut channels = exr::prelude::SmallVec::new();
    for (aov, pixels) in &image.layers {
        if *aov == Aov::Alpha {
            channels.push(AnyChannel::new("A", FlatSamples::F32(pixels.iter().map(|p| p[0]).collect())));
            continue;
        }
        for (c, letter) in ["R", "G", "B"].into_iter().enumerate() {
            let samples = FlatSamples::F32(pixels.iter().map(|p| p[c]).collect());
            channels.push(AnyChannel::new(channel_name(*aov, letter).as_str(), samples));
        }
    }
    let size = (image.width as usize, image.height as usize);
    let mut attributes = LayerAttributes::default();
    for (name, value) in metadata {
        let value = exr::meta::attribute::AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes()));
        attributes.other.insert(Text::from_slice_unchecked(name.as_bytes()), value);
    }
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut bytes = Vec::new();
    Image::from_layer(layer).write().to_buffered(Cursor::new(&mut bytes))?;
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn channel_name(aov: Aov, letter: &str) -> String {
    if matches!(aov, Aov::Beauty | Aov::Alpha) { letter.to_owned() } else { format!("{aov}.{letter}") }
}

/// Sorts the header's attributes by name: the exr crate keeps them in a hash map with random order. The header's length
/// does not change, so the offsets after it stay valid.
///
/// Layout: 8 bytes of magic and version, then `name\0 type\0 size:i32 value[size]` each, then `\0`.
fn sort_attributes(bytes: &mut [u8]) {
    const START: usize = 8;
    let text_end = |bytes: &[u8], from: usize| from + bytes[from..].iter().position(|&b| b == 0).unwrap_or(0);
    let mut attributes = Vec::new();
    let mut at = START;
    while bytes[at] != 0 {
        let size_at = text_end(bytes, text_end(bytes, at) + 1) + 1;
        let size = u32::from_le_bytes([bytes[size_at], bytes[size_at + 1], bytes[size_at + 2], bytes[size_at + 3]]);
        let end = size_at + 4 + size as usize;
        attributes.push(bytes[at..end].to_vec());
        at = end;
    }
    attributes.sort();
    bytes[START..at].copy_from_slice(&attributes.concat());
}

/// The layers and header text in an OpenEXR file's bytes. The error is a sentence without its subject, the path.
pub fn decode(bytes: &[u8]) -> std::result::Result<(Layers, Metadata), String> {
    decode_from(Cursor::new(bytes))
}

fn decode_from(file: impl Read + Seek + Send) -> std::result::Result<(Layers, Metadata), String> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(|e| unreadable(&e))?;
    let layer = image.layer_data;
    let size = layer.size;
    let find = |name: String| layer.channel_data.list.iter().find(|c| c.name.to_string() == name);
    let mut layers = Vec::new();
    for &aov in Aov::ALL {
        let letters = if aov == Aov::Alpha { ["A"; 3] } else { ["R", "G", "B"] };
        let [Some(r), Some(g), Some(b)] = letters.map(|letter| find(channel_name(aov, letter))) else {
            if aov == Aov::Beauty {
                return Err("has no channels R, G and B".into());
            }
            continue;
        };
        let [r, g, b] = [r, g, b].map(|c| c.sample_data.values_as_f32());
        let pixels: Vec<[f32; 3]> = r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
        if pixels.len() != size.0 * size.1 {
            return Err(format!("stores its {aov} channels at a lower resolution, which is not supported"));
        }
        layers.push((aov, pixels));
    }
    let mut metadata = Metadata::new();
    for (name, value) in image.attributes.other.iter().chain(&layer.attributes.other) {
        if let exr::meta::attribute::AttributeValue::Text(text) = value {
            let value = String::from_utf8_lossy(text.bytes()).into_owned();
            metadata.insert(String::from_utf8_lossy(name.bytes()).into_owned(), value);
        }
    }
    Ok((Layers { width: size.0 as u32, height: size.1 as u32, layers }, metadata))
}
