//! OpenEXR files in linear float32: channels `R G B` for the image, `A` for its coverage, `direct.R` … for further
//! layers; metadata in the header.
//!
//! Files of other programs may have several parts, luminance and chroma (`subsampled`), and other primaries. The first
//! part with colours is used.

mod subsampled;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use exr::io::PeekRead;
use exr::math::Vec2;
use exr::meta::attribute::AttributeValue;
use exr::meta::header::Header;
use exr::meta::{Headers, Requirements, magic_number};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers, Text,
    WritableImage,
};
use glam::{DMat3, DVec2, DVec3};

use super::read;
use crate::color::{Chromaticities, REC_709};
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

    /// Reads R G B, all layers of [`Aov`] in the file, and the metadata in its header.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn read_exr(path: &Path) -> Result<(Self, Metadata)> {
        let length = read::about(path, "an OpenEXR image")?.len();
        let check_memory = |bytes: u64| read::check_memory(path, bytes, "image");
        let file = File::open(path).map_err(|e| read::unreadable(path, &e))?;
        let mut file = BufReader::new(file);
        let headers = headers(&mut file).map_err(|problem| Error::file(path, problem))?;
        // Pixels of one channel. A part may state more than any machine can hold.
        let pixels = headers.iter().map(|h| (h.layer_size.width() as u64).saturating_mul(h.layer_size.height() as u64));
        let pixels = pixels.fold(0, u64::saturating_add);
        let channels = headers.iter().map(|header| header.channels.list.len() as u64).max().unwrap_or(0);
        let values = pixels.saturating_mul(channels);
        // Values exist twice: as read, and as layers.
        check_memory(values.saturating_mul(8))?;
        read::check_length(path, values <= length.saturating_mul(VALUES_MAX))?;
        decode_from(file, &headers).map_err(|problem| Error::file(path, problem))
    }
}

/// The maximum number of values per byte of a file: deflate can produce 1032 bytes from one, and a value has two.
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
        let value = AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes()));
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

/// Sorts the header's attributes by name, because the exr crate stores them in a hash map with random order. The
/// header's length does not change, so later offsets stay valid.
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

/// The layers and metadata in the bytes of an OpenEXR file. The error is a sentence without its subject, the path.
pub fn decode(bytes: &[u8]) -> std::result::Result<(Layers, Metadata), String> {
    let mut file = Cursor::new(bytes);
    let headers = headers(&mut file)?;
    decode_from(file, &headers)
}

/// The headers of a file's parts, without a comparison between them. The file is then positioned after them.
fn headers(file: &mut (impl Read + Seek)) -> std::result::Result<Headers, String> {
    let mut read = || {
        let mut buffered = PeekRead::new(&mut *file);
        magic_number::validate_exr(&mut buffered)?;
        let requirements = Requirements::read(&mut buffered)?;
        requirements.validate()?;
        Header::read_all(&mut buffered, &requirements, false)
    };
    read().map_err(|e| unreadable(&e))
}

/// One part of a file with the information of its header.
struct FilePart {
    size: Vec2<usize>,
    /// Channels by name with a sample for each pixel, unless the part has fewer.
    channels: Vec<(String, FlatSamples)>,
    attributes: Vec<(Text, AttributeValue)>,
    chromaticities: Chromaticities,
}

impl FilePart {
    fn new(header: &Header, channels: Vec<(String, FlatSamples)>) -> Self {
        let attributes = header.shared_attributes.other.iter().chain(&header.own_attributes.other);
        let attributes = attributes.map(|(name, value)| (name.clone(), value.clone())).collect();
        let point = |c: Vec2<f32>| DVec2::new(c.x().into(), c.y().into());
        let chromaticities = header.shared_attributes.chromaticities.map_or(REC_709, |c| Chromaticities {
            primaries: [c.red, c.green, c.blue].map(point),
            white: point(c.white),
        });
        Self { size: header.layer_size, channels, attributes, chromaticities }
    }

    fn find(&self, name: &str) -> Option<&FlatSamples> {
        self.channels.iter().find(|(channel, _)| channel == name).map(|(_, samples)| samples)
    }

    fn rgb(&self, names: [&str; 3]) -> Option<Vec<[f32; 3]>> {
        let [Some(r), Some(g), Some(b)] = names.map(|name| self.find(name)) else { return None };
        let [r, g, b] = [r, g, b].map(FlatSamples::values_as_f32);
        Some(r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect())
    }

    /// Colours from the luminance Y and, if it exists, the chroma: RY is (R − Y) / Y, and BY the same for blue.
    fn luminance(&self) -> Option<Vec<[f32; 3]>> {
        let grey = self.rgb(["Y"; 3])?;
        let Some(chroma) = self.rgb(["RY", "Y", "BY"]).filter(|chroma| chroma.len() == grey.len()) else {
            return Some(grey);
        };
        let of_luminance = self.chromaticities.xyz_from_rgb().or_else(|| REC_709.xyz_from_rgb())?.row(1).as_vec3();
        let color = |[ry, y, by]: [f32; 3]| {
            let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
            [r, (y - r * of_luminance.x - b * of_luminance.z) / of_luminance.y, b]
        };
        Some(chroma.into_iter().map(color).collect())
    }
}

/// The index of the part with the image: the first one with colours, else the first one with a luminance.
fn part_of_image(headers: &[Header]) -> std::result::Result<usize, String> {
    let has = |header: &Header, names: &[&str]| {
        names.iter().all(|name| header.channels.list.iter().any(|channel| channel.name.to_string() == *name))
    };
    let first = |names: &[&str]| headers.iter().position(|header| !header.deep && has(header, names));
    first(&["R", "G", "B"]).or_else(|| first(&["Y"])).ok_or_else(|| "has no channels R, G and B, and no Y".into())
}

/// The layers of a file that is positioned after its headers.
fn decode_from(
    mut file: impl Read + Seek + Send,
    headers: &[Header],
) -> std::result::Result<(Layers, Metadata), String> {
    let index = part_of_image(headers)?;
    let part = if subsampled::is_subsampled(&headers[index]) {
        subsampled::read(file, headers, index).map_err(|e| unreadable(&e))?
    } else {
        file.rewind().map_err(|e| format!("cannot be read: {e}"))?;
        let reading = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().all_layers();
        let mut image = reading.all_attributes().from_buffered(file).map_err(|e| unreadable(&e))?;
        let channels = image.layer_data.swap_remove(index).channel_data.list;
        FilePart::new(&headers[index], channels.into_iter().map(|c| (c.name.to_string(), c.sample_data)).collect())
    };
    let to_rec_709 = part.chromaticities.rec_709_from_rgb().unwrap_or(DMat3::IDENTITY);
    let mut layers = Vec::new();
    for &aov in Aov::ALL {
        let letters = if aov == Aov::Alpha { ["A"; 3] } else { ["R", "G", "B"] };
        let names = letters.map(|letter| channel_name(aov, letter));
        let pixels = part.rgb(names.each_ref().map(String::as_str));
        let pixels = if aov == Aov::Beauty { pixels.or_else(|| part.luminance()) } else { pixels };
        let Some(mut pixels) = pixels else { continue };
        if pixels.len() != part.size.area() {
            return Err(format!("stores its {aov} channels at a lower resolution, which is not supported"));
        }
        let is_color = matches!(aov, Aov::Beauty | Aov::Direct | Aov::Indirect | Aov::Albedo);
        if is_color && to_rec_709 != DMat3::IDENTITY {
            let converted = |p: &[f32; 3]| (to_rec_709 * DVec3::from(p.map(f64::from))).as_vec3().to_array();
            pixels.iter_mut().for_each(|pixel| *pixel = converted(pixel));
        }
        layers.push((aov, pixels));
    }
    let mut metadata = Metadata::new();
    for (name, value) in &part.attributes {
        if let AttributeValue::Text(text) = value {
            let value = String::from_utf8_lossy(text.bytes()).into_owned();
            metadata.insert(String::from_utf8_lossy(name.bytes()).into_owned(), value);
        }
    }
    Ok((Layers { width: part.size.0 as u32, height: part.size.1 as u32, layers }, metadata))
}
