//! Reads equirectangular maps: OpenEXR, and Radiance .hdr by `hdr`.

use std::path::Path;

use glam::Vec3;

use super::{MOST_TEXELS, Panorama, hdr};
use crate::layers::Layers;
use crate::{Error, Result};

/// Maximum texels per side.
const SIDE_MAX: u32 = 16384;

/// Reads the map at `path`, an OpenEXR file (R, G, B) or a Radiance file by its ending, and halves it until it has at
/// most [`MOST_TEXELS`] texels, and `max_texture` texels a side. Also returns a sentence about every change.
///
/// # Errors
/// [`Error::File`] for files that are missing or damaged, or that need more than half of the free memory by their
/// header.
pub fn read(path: &Path, max_texture: Option<u32>) -> Result<(Panorama, Vec<String>)> {
    let exr = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"));
    let (mut map, mut notes) = if exr { (read_exr(path)?, Vec::new()) } else { hdr::read(path)? };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    notes.extend(mend(&mut map.radiance, &name));
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
        notes.push(format!("{name} is not twice as wide as high: it is stretched around the whole sky"));
    }
    Ok((map, notes))
}

fn read_exr(path: &Path) -> Result<Panorama> {
    let (layers, _) = Layers::read_exr(path)?;
    let radiance = layers.beauty().iter().map(|c| Vec3::from(*c)).collect();
    check_size(path, layers.width, layers.height)?;
    Ok(Panorama { width: layers.width as usize, height: layers.height as usize, radiance })
}

pub(super) fn check_size(path: &Path, width: u32, height: u32) -> Result<()> {
    let sentence = match (width.min(height), width.max(height)) {
        (0, _) => "has no texels; save it again".to_owned(),
        (_, side) if side > SIDE_MAX => format!("has more than {SIDE_MAX} texels a side; make it smaller"),
        _ => return Ok(()),
    };
    Err(Error::file(path, sentence))
}

/// Replaces values that are not finite or negative, and returns sentences about it.
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
        format!("{name} has {texels} negative or NaN, read as black; infinite ones are read as the largest number");
    if count > 0 { vec![note] } else { Vec::new() }
}

/// Means of two by two texels; the last row or column of an odd number is dropped.
fn halved(map: &Panorama) -> Panorama {
    let (width, height) = ((map.width / 2).max(1), (map.height / 2).max(1));
    let texel = |x: usize, y: usize| map.radiance[y.min(map.height - 1) * map.width + x.min(map.width - 1)];
    let mean = |x: usize, y: usize| {
        (texel(2 * x, 2 * y) + texel(2 * x + 1, 2 * y) + texel(2 * x, 2 * y + 1) + texel(2 * x + 1, 2 * y + 1)) / 4.0
    };
    let radiance = (0..height).flat_map(|y| (0..width).map(move |x| mean(x, y))).collect();
    Panorama { width, height, radiance }
}
