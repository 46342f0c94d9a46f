//! Procedural textures, embedded as PNG.

use std::f64::consts::TAU;

use crate::output::picture;
use crate::{Error, Result};

/// Edge of every texture in texels.
const EDGE: u32 = 256;
/// Floor tiles along the edge of the texture.
const TILES: u32 = 4;

/// The floor at a texel.
struct Stone {
    /// 0 in a joint, 1 on the flat part of a tile; the rim between is rounded.
    height: f64,
    /// The brightness of the tile, 0 to 1.
    tone: f64,
    /// The brightness of a speckle, 0 to 1.
    grain: f64,
}

/// The image with this name as a PNG file.
pub fn png(name: &str) -> Result<Vec<u8>> {
    match name {
        "floor colour" => encode(3, floor_color),
        "floor normal" => encode(3, floor_normal),
        "floor roughness" => encode(3, floor_roughness),
        "lattice" => encode(4, lattice),
        _ => Err(Error::Usage(format!("there is no image {name:?}"))),
    }
}

/// Stone tiles in four warm greys with dark joints: sRGB.
fn floor_color(x: u32, y: u32) -> [f64; 4] {
    let stone = stone(x, y);
    let light = if stone.height < 0.2 { 92.0 } else { 138.0 + 48.0 * stone.tone + 12.0 * stone.grain };
    [light, light * 0.955, light * 0.89, 255.0]
}

/// The rounded rims of the tiles as a tangent-space normal map, +Y up.
fn floor_normal(x: u32, y: u32) -> [f64; 4] {
    let height = |dx: u32, dy: u32| stone((x + EDGE + dx - 1) % EDGE, (y + EDGE + dy - 1) % EDGE).height;
    let normal = glam::dvec3(height(0, 1) - height(2, 1), height(1, 2) - height(1, 0), 1.5).normalize();
    let [r, g, b] = ((normal + 1.0) * 127.5).to_array();
    [r, g, b, 255.0]
}

/// Green: roughness, polished tiles and dull joints. Blue: metallic, none.
fn floor_roughness(x: u32, y: u32) -> [f64; 4] {
    let stone = stone(x, y);
    [0.0, if stone.height < 0.5 { 230.0 } else { 84.0 + 30.0 * stone.tone }, 0.0, 255.0]
}

/// A lattice of diagonal bars and rings in brass; alpha is its coverage.
fn lattice(x: u32, y: u32) -> [f64; 4] {
    let (u, v) = ((f64::from(x) + 0.5) / f64::from(EDGE), (f64::from(y) + 0.5) / f64::from(EDGE));
    // Distances in texture edges: to the nearest diagonal, and to a ring about the centre and the corners.
    let diagonal = |w: f64| (w - w.round()).abs() * std::f64::consts::FRAC_1_SQRT_2;
    let bars = diagonal(u + v).min(diagonal(u - v)) - 0.05;
    let ring = |cx: f64, cy: f64| ((u - cx).hypot(v - cy) - 0.25).abs() - 0.045;
    let corners = [(0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
    let solid = corners.iter().fold(bars, |nearest, &(cx, cy)| nearest.min(ring(cx, cy)));
    let coverage = (0.5 - solid * f64::from(EDGE) / 4.0).clamp(0.0, 1.0);
    [214.0, 172.0, 104.0, 255.0 * coverage]
}

fn stone(x: u32, y: u32) -> Stone {
    let size = EDGE / TILES;
    let rim = |i: u32| f64::from((i % size).min(size - 1 - i % size));
    let height = ((rim(x).min(rim(y)) - 1.0) / 4.0).clamp(0.0, 1.0);
    let tile = (x / size) + TILES * (y / size);
    // Speckles of 2×2 texels in four steps.
    let grain = f64::from(hash(1000 + x / 2 + (y / 2) * EDGE) % 4) / 3.0;
    Stone { height: (height * TAU / 4.0).sin(), tone: f64::from(hash(tile) % 4) / 3.0, grain }
}

/// PCG's output permutation: Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
fn hash(seed: u32) -> u32 {
    let state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Encodes the first `channels` (3 or 4) of the values 0 to 255 that `texel(x, y)` returns; rows from the top.
fn encode(channels: usize, texel: impl Fn(u32, u32) -> [f64; 4]) -> Result<Vec<u8>> {
    let texel = &texel;
    let bytes: Vec<u8> = (0..EDGE)
        .flat_map(|y| (0..EDGE).flat_map(move |x| texel(x, y).into_iter().take(channels)))
        .map(|value| value.round() as u8)
        .collect();
    if channels == 4 { picture::encode_rgba(EDGE, EDGE, bytes) } else { picture::encode_rgb(EDGE, EDGE, bytes) }
}
