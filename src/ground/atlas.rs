//! Packs all textures at full size into one 2D array, because the weakest supported device has few bindings and no
//! dynamic indexing of samplers.
//!
//! Each mip chain occupies one rectangle of one layer: level 0, and below it the other levels side by side. GLSL
//! filters in shader code (`glsl/ground/texture.glsl`). Layers have the size of the largest rectangle or a small
//! multiple of it, whichever wastes least.

use super::layout::TextureLevel;

/// Image limits that every Vulkan device supports: texels along a side, and array layers.
const SIDE: u32 = 4096;
const LAYERS: u32 = 256;

/// The position of one mip chain.
#[derive(Clone, Debug)]
pub struct ChainPlace {
    pub layer: u32,
    pub levels: Vec<TextureLevel>,
}

#[derive(Clone, Debug)]
pub struct Atlas {
    /// Width and height of the array in texels.
    pub width: u32,
    pub height: u32,
    pub layers: u32,
    /// In the order of the packed chains.
    pub places: Vec<ChainPlace>,
}

impl Atlas {
    /// Packs chains, each given as the sizes of its levels in texels, the largest first. Without chains the atlas has
    /// one texel.
    pub fn pack(chains: &[Vec<(u32, u32)>]) -> Self {
        let rects: Vec<(u32, u32)> = chains.iter().map(|levels| chain_rect(levels)).collect();
        let widest = rects.iter().map(|r| r.0).max().unwrap_or(1);
        let tallest = rects.iter().map(|r| r.1).max().unwrap_or(1);
        let packed = |(w, h)| (w, h, shelves(&rects, w, h));
        let fits = |&(w, h): &(u32, u32)| w.max(h) <= SIDE;
        let multiples = [(2, 1), (1, 2), (2, 2), (4, 4)].map(|(x, y)| (widest * x, tallest * y));
        let candidates = [(widest, tallest)].into_iter().chain(multiples.into_iter().filter(fits));
        let (mut width, mut height, mut corners) = candidates
            .map(packed)
            .min_by_key(|(w, h, corners)| u64::from(*w) * u64::from(*h) * u64::from(layer_count(corners)))
            .expect("there is a first candidate");
        // Thousands of small textures need fewer, larger layers.
        while layer_count(&corners) > LAYERS && fits(&(2 * width, 2 * height)) {
            (width, height, corners) = packed((2 * width, 2 * height));
        }
        let places = chains
            .iter()
            .zip(&corners)
            .map(|(levels, &(x, y, layer))| ChainPlace { layer, levels: place_levels(levels, x, y) })
            .collect();
        Self { width, height, layers: layer_count(&corners), places }
    }

    /// The size of the array in bytes, 4 per texel.
    pub fn bytes(&self) -> u64 {
        4 * u64::from(self.width) * u64::from(self.height) * u64::from(self.layers)
    }
}

fn layer_count(corners: &[(u32, u32, u32)]) -> u32 {
    corners.iter().map(|c| c.2 + 1).max().unwrap_or(1)
}

fn chain_rect(levels: &[(u32, u32)]) -> (u32, u32) {
    let below: u32 = levels.iter().skip(1).map(|l| l.0).sum();
    let second = levels.get(1).map_or(0, |l| l.1);
    (levels[0].0.max(below), levels[0].1 + second)
}

fn place_levels(levels: &[(u32, u32)], x: u32, y: u32) -> Vec<TextureLevel> {
    let (width, height) = levels[0];
    let mut placed = vec![TextureLevel { x, y, width, height }];
    let (mut along, below) = (x, y + height);
    for &(width, height) in &levels[1..] {
        placed.push(TextureLevel { x: along, y: below, width, height });
        along += width;
    }
    placed
}

/// Shelf packing, tallest first: (x, y, layer) of each rectangle.
fn shelves(rects: &[(u32, u32)], width: u32, height: u32) -> Vec<(u32, u32, u32)> {
    let mut order: Vec<usize> = (0..rects.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(rects[i].1), std::cmp::Reverse(rects[i].0), i));
    let mut corners = vec![(0, 0, 0); rects.len()];
    let (mut x, mut y, mut shelf, mut layer) = (0, 0, 0, 0);
    for i in order {
        let (w, h) = rects[i];
        if x + w > width {
            (x, y) = (0, y + shelf);
            shelf = 0;
        }
        if y + h > height {
            (x, y, shelf, layer) = (0, 0, 0, layer + 1);
        }
        corners[i] = (x, y, layer);
        x += w;
        shelf = shelf.max(h);
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(mut w: u32, mut h: u32) -> Vec<(u32, u32)> {
        let mut levels = vec![(w, h)];
        while w > 1 || h > 1 {
            (w, h) = ((w / 2).max(1), (h / 2).max(1));
            levels.push((w, h));
        }
        levels
    }

    #[test]
    fn every_level_has_texels_of_its_own() {
        let chains: Vec<_> =
            [(64, 64), (1, 256), (33, 7), (256, 1), (1, 1), (64, 128)].map(|(w, h)| chain(w, h)).into();
        let atlas = Atlas::pack(&chains);
        let mut taken = vec![false; (atlas.width * atlas.height * atlas.layers) as usize];
        for place in &atlas.places {
            for l in &place.levels {
                for y in l.y..l.y + l.height {
                    for x in l.x..l.x + l.width {
                        assert!(x < atlas.width && y < atlas.height && place.layer < atlas.layers);
                        let texel = &mut taken[((place.layer * atlas.height + y) * atlas.width + x) as usize];
                        assert!(!std::mem::replace(texel, true), "two levels share a texel");
                    }
                }
            }
        }
    }

    #[test]
    fn many_small_textures_need_few_layers() {
        for (count, side) in [(2100, 4), (20_000, 1), (5000, 64)] {
            let atlas = Atlas::pack(&vec![chain(side, side); count]);
            let texels = count as u64 * u64::from(side * (side + side / 2));
            assert!(
                atlas.layers <= LAYERS && atlas.width.max(atlas.height) <= SIDE,
                "{count}: {} layers",
                atlas.layers
            );
            assert!(atlas.bytes() <= 2 * 4 * texels, "{count}: {} bytes", atlas.bytes());
        }
        assert_eq!(Atlas::pack(&vec![chain(2048, 2048); 300]).layers, 300, "nothing larger is sure to fit");
    }

    #[test]
    fn equal_textures_waste_nothing() {
        let atlas = Atlas::pack(&vec![chain(1024, 1024); 40]);
        assert_eq!(atlas.bytes(), 40 * 4 * 1024 * 1536);
    }
}
