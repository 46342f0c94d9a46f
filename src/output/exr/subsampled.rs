//! Images with channels that have fewer samples than pixels, such as luminance and chroma. The crate `exr` unpacks
//! their blocks, but cannot store their samples.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

use exr::compression::Compression;
use exr::error::{Error, Result};
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, IntegerBounds, SampleType};
use exr::meta::header::Header;
use exr::prelude::{FlatSamples, f16};

use super::FilePart;

/// Supported pixels per sample: blocks of several lines then have a whole number of samples.
const SAMPLINGS: [usize; 3] = [1, 2, 4];

/// Whether a channel has fewer samples than pixels.
pub fn is_subsampled(header: &Header) -> bool {
    header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1))
}

/// Reads part number `index` of a file that is positioned at its offset tables. Channels are interpolated linearly to a
/// sample for each pixel.
pub fn read(mut file: impl Read + Seek, headers: &[Header], index: usize) -> Result<FilePart> {
    let header = &headers[index];
    let (size, channels) = (header.layer_size, &header.channels.list);
    check(header)?;
    let before: usize = headers[..index].iter().map(|header| header.chunk_count).sum();
    file.seek_relative(8 * before as i64)?;
    let offsets: Vec<u64> =
        (0..header.chunk_count).map(|_| next(&mut file).map(u64::from_le_bytes)).collect::<Result<_>>()?;
    let mut planes: Vec<Vec<f32>> = vec![Vec::new(); channels.len()];
    planes.iter_mut().zip(channels).for_each(|(plane, channel)| plane.resize(samples(channel, size).area(), 0.0));
    for offset in offsets {
        file.seek(SeekFrom::Start(offset))?;
        if headers.len() > 1 && u32::from_le_bytes(next(&mut file)?) as usize != index {
            return Err(Error::Invalid("a block of another part".into()));
        }
        let y = i32::from_le_bytes(next(&mut file)?);
        let length = u32::from_le_bytes(next(&mut file)?);
        if length as usize > header.max_block_byte_size() {
            return Err(Error::Invalid("a block's length".into()));
        }
        let mut packed = Vec::new();
        (&mut file).take(length.into()).read_to_end(&mut packed)?;
        let row = y.checked_sub(header.own_attributes.layer_position.y()).and_then(|row| usize::try_from(row).ok());
        let row = row.filter(|row| *row < size.height()).ok_or_else(|| Error::Invalid("a block's place".into()))?;
        let rows = header.compression.scan_lines_per_block().min(size.height() - row);
        unpack(header, packed, row..row + rows, &mut planes)?;
    }
    let upsampled = |(plane, channel): (Vec<f32>, &ChannelDescription)| {
        (channel.name.to_string(), FlatSamples::F32(upsampled(&plane, channel.sampling, size)))
    };
    Ok(FilePart::new(header, planes.into_iter().zip(channels).map(upsampled).collect()))
}

/// Refuses fractional numbers of samples, and compressions whose blocks the crate misreads.
fn check(header: &Header) -> Result<()> {
    use Compression::{B44, B44A};
    if matches!(header.compression, B44 | B44A) {
        return Err(Error::NotSupported(format!("{} of fewer samples than pixels", header.compression).into()));
    }
    let Vec2(x, y) = header.own_attributes.layer_position;
    let divides = |sampling: usize, place: i32, length: usize| {
        SAMPLINGS.contains(&sampling) && place.rem_euclid(sampling as i32) == 0 && length.is_multiple_of(sampling)
    };
    let fits = |c: &ChannelDescription| {
        divides(c.sampling.x(), x, header.layer_size.width()) && divides(c.sampling.y(), y, header.layer_size.height())
    };
    let plain = !header.deep && header.blocks == BlockDescription::ScanLines && header.layer_size.area() > 0;
    match plain && header.channels.list.iter().all(fits) {
        true => Ok(()),
        false => Err(Error::NotSupported("channels with a number of samples that does not divide its size".into())),
    }
}

/// Samples of a channel across and down.
fn samples(channel: &ChannelDescription, size: Vec2<usize>) -> Vec2<usize> {
    size / channel.sampling
}

/// Adds the samples of a block of rows to the planes of their channels.
fn unpack(header: &Header, packed: Vec<u8>, rows: Range<usize>, planes: &mut [Vec<f32>]) -> Result<()> {
    let (size, Vec2(left, top)) = (header.layer_size, header.own_attributes.layer_position);
    let lines = || {
        let line = move |y: usize| {
            let stored = move |(_, c): &(usize, &ChannelDescription)| y.is_multiple_of(c.sampling.y());
            header.channels.list.iter().enumerate().filter(stored).map(move |(at, channel)| (y, at, channel))
        };
        rows.clone().flat_map(line)
    };
    let bytes = |channel: &ChannelDescription| samples(channel, size).width() * channel.sample_type.bytes_per_sample();
    let length: usize = lines().map(|(_, _, channel)| bytes(channel)).sum();
    // The crate asks for the bytes of a pixel, and assumes a sample per pixel in all channels.
    let mut described = header.clone();
    described.channels.bytes_per_pixel = length / (rows.len() * size.width());
    if described.channels.bytes_per_pixel * rows.len() * size.width() != length || length == 0 {
        return Err(Error::NotSupported("blocks of so few samples".into()));
    }
    let place = IntegerBounds::new(Vec2(left, top + rows.start as i32), Vec2(size.width(), rows.len()));
    let unpacked = header.compression.decompress_image_section_from_le(&described, packed, place, false)?;
    let mut rest = &unpacked[..];
    for (y, at, channel) in lines() {
        let width = samples(channel, size).width();
        let (line, after) =
            rest.split_at_checked(bytes(channel)).ok_or_else(|| Error::Invalid("a short block".into()))?;
        rest = after;
        let from = y / channel.sampling.y() * width;
        let plane = planes[at][from..from + width].iter_mut();
        match channel.sample_type {
            SampleType::F16 => plane.zip(line.as_chunks().0).for_each(|(to, b)| *to = f16::from_ne_bytes(*b).to_f32()),
            SampleType::F32 => plane.zip(line.as_chunks().0).for_each(|(to, b)| *to = f32::from_ne_bytes(*b)),
            SampleType::U32 => plane.zip(line.as_chunks().0).for_each(|(to, b)| *to = u32::from_ne_bytes(*b) as f32),
        }
    }
    Ok(())
}

/// Samples are at multiples of the sampling, starting with the first pixel.
fn upsampled(plane: &[f32], sampling: Vec2<usize>, size: Vec2<usize>) -> Vec<f32> {
    let stored = size / sampling;
    let between = |at: usize, sampling: usize, count: usize| {
        let first = at / sampling;
        (first, (first + 1).min(count - 1), (at % sampling) as f32 / sampling as f32)
    };
    let mut pixels = Vec::with_capacity(size.area());
    for y in 0..size.height() {
        let (above, below, down) = between(y, sampling.y(), stored.height());
        for x in 0..size.width() {
            let (left, right, across) = between(x, sampling.x(), stored.width());
            let in_row = |row: usize| {
                let [a, b] = [left, right].map(|column| plane[row * stored.width() + column]);
                a + (b - a) * across
            };
            let (a, b) = (in_row(above), in_row(below));
            pixels.push(a + (b - a) * down);
        }
    }
    pixels
}

/// The next bytes of the file.
fn next<const N: usize>(file: &mut impl Read) -> Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
