//! Reads equirectangular maps: Radiance .hdr and OpenEXR.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::{MOST_TEXELS, Panorama};
use crate::error::said;
use crate::layers::Layers;
use crate::output::read as input;
use crate::{Error, Result};

/// Texels a side at most.
const SIDE_MAX: u32 = 16384;

/// Bytes of a Radiance file's header at most: it is some lines of text.
const HEADER_MAX: u64 = 1 << 16;

/// Reads the map at `path`, by its ending an OpenEXR file (R, G, B) or a Radiance one, and halves it until it has at most
/// [`MOST_TEXELS`], and `max_texture` texels a side. Also returns a sentence about everything that was changed.
///
/// # Errors
/// [`Error::File`] for what is missing, damaged, or needs more memory than half of what is free: known from its header.
pub fn read(path: &Path, max_texture: Option<u32>) -> Result<(Panorama, Vec<String>)> {
    let exr = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"));
    let mut map = if exr { read_exr(path)? } else { read_hdr(path)? };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut notes = mend(&mut map.radiance, &name);
    let most = max_texture.map_or(usize::MAX, |texels| texels as usize);
    let whole = (map.width, map.height);
    while map.width * map.height > MOST_TEXELS || map.width.max(map.height) > most {
        map = halved(&map);
    }
    if (map.width, map.height) != whole {
        let (width, height) = whole;
        notes.push(format!("{name} was scaled down from {width}x{height} to {}x{} texels", map.width, map.height));
    }
    if whole.0 != 2 * whole.1 {
        notes.push(format!("{name} is not twice as wide as high: it is taken to go all around all the same"));
    }
    Ok((map, notes))
}

fn read_exr(path: &Path) -> Result<Panorama> {
    let (layers, _) = Layers::read_exr(path)?;
    let radiance = layers.beauty().iter().map(|c| Vec3::from(*c)).collect();
    check_size(path, layers.width, layers.height)?;
    Ok(Panorama { width: layers.width as usize, height: layers.height as usize, radiance })
}

fn read_hdr(path: &Path) -> Result<Panorama> {
    let length = input::about(path, "a Radiance image")?.len();
    let broken = |e| Error::file(path, format!("is not a readable Radiance image ({}); save it again", said(&e)));
    let failed = |e: std::io::Error| input::unreadable(path, &e);
    let mut file = File::open(path).map_err(failed)?;
    // The decoder keeps the header, however long it is.
    let mut start = Vec::new();
    (&mut file).take(HEADER_MAX).read_to_end(&mut start).map_err(failed)?;
    if !start.windows(2).any(|pair| pair == b"\n\n") {
        return Err(Error::file(path, "is not a readable Radiance image (its header does not end); save it again"));
    }
    file.rewind().map_err(failed)?;
    let decoder = HdrDecoder::new(BufReader::new(file)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check_size(path, width, height)?;
    let texels = width as usize * height as usize;
    // Run lengths make 127 texels of 8 bytes at best.
    input::check_length(path, length >= texels as u64 / 64)?;
    // As the decoder holds it, as it is read, and as radiance.
    input::check_memory(path, 40 * texels as u64, "map")?;
    // Zeros cost nothing until they are overwritten: a file may claim more than it holds.
    let mut channels = vec![0.0_f32; 3 * texels];
    decoder.read_image(bytemuck::cast_slice_mut(&mut channels)).map_err(broken)?;
    let radiance = channels.chunks_exact(3).map(Vec3::from_slice).collect();
    Ok(Panorama { width: width as usize, height: height as usize, radiance })
}

fn check_size(path: &Path, width: u32, height: u32) -> Result<()> {
    let sentence = match (width.min(height), width.max(height)) {
        (0, _) => "has no texels; save it again".to_owned(),
        (_, side) if side > SIDE_MAX => format!("has more than {SIDE_MAX} texels a side; make it smaller"),
        _ => return Ok(()),
    };
    Err(Error::file(path, sentence))
}

/// Puts numbers for what is none, and says so.
fn mend(radiance: &mut [Vec3], name: &str) -> Vec<String> {
    let finite = |c: &f32| c.is_finite();
    let brightest = radiance.iter().flat_map(Vec3::to_array).filter(finite).fold(0.0, f32::max);
    let mended = |c: f32| if c == f32::INFINITY { brightest } else { c.max(0.0) };
    let mut count = 0;
    for texel in radiance.iter_mut().filter(|texel| !(texel.is_finite() && texel.min_element() >= 0.0)) {
        *texel = Vec3::from(texel.to_array().map(mended));
        count += 1;
    }
    let texels = if count == 1 { "1 texel that is".to_owned() } else { format!("{count} texels that are") };
    let note =
        format!("{name} has {texels} negative or no number, taken as black; what is infinite as the brightest number");
    if count > 0 { vec![note] } else { Vec::new() }
}

/// Means of two by two texels; the last of an odd number is left out.
fn halved(map: &Panorama) -> Panorama {
    let (width, height) = ((map.width / 2).max(1), (map.height / 2).max(1));
    let texel = |x: usize, y: usize| map.radiance[y.min(map.height - 1) * map.width + x.min(map.width - 1)];
    let mean = |x: usize, y: usize| {
        (texel(2 * x, 2 * y) + texel(2 * x + 1, 2 * y) + texel(2 * x, 2 * y + 1) + texel(2 * x + 1, 2 * y + 1)) / 4.0
    };
    let radiance = (0..height).flat_map(|y| (0..width).map(move |x| mean(x, y))).collect();
    Panorama { width, height, radiance }
}
