//! What of a frame is shown: a layer of the image, or what the grid holds where the image shows a surface.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use twobounce::ground::layout::ListItem;
use twobounce::layers::{Aov, Layers};
use twobounce::renderer::Renderer;
use twobounce::scene::View;
use twobounce::vk::{Context, download};
use twobounce::{Error, Result};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layer {
    Image(Aov),
    Grid(GridLayer),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridLayer {
    /// Each voxel of a level, in a colour of its own; its side is 2^level of the finest.
    Voxels(u32),
    /// How many triangles the list of the voxel has.
    Lists,
}

/// Levels of voxels that can be shown.
pub const LEVELS: u32 = 5;

impl Layer {
    pub const BEAUTY: Self = Self::Image(Aov::Beauty);

    /// Every one, those of the image first.
    pub fn all() -> impl Iterator<Item = Self> {
        let voxels = (0..LEVELS).map(GridLayer::Voxels);
        let grid = voxels.chain([GridLayer::Lists]).map(Self::Grid);
        Aov::ALL.iter().copied().map(Self::Image).chain(grid)
    }

    pub fn name(self) -> String {
        match self {
            Self::Image(layer) => layer.name().to_owned(),
            Self::Grid(GridLayer::Voxels(0)) => "voxels".into(),
            Self::Grid(GridLayer::Voxels(level)) => format!("voxels, level {level}"),
            Self::Grid(GridLayer::Lists) => "list lengths".into(),
        }
    }

    /// What its colours say.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Grid(GridLayer::Lists) => "1 black, 2 blue, 4 cyan, 8 yellow, 16 and more red",
            Self::Grid(GridLayer::Voxels(_)) => "a colour per voxel; grey lies outside of the grid",
            Self::Image(_) => "",
        }
    }

    /// The image's layers that it is made of; alpha tells what is sky, which exposure leaves out.
    pub fn needs(self) -> Vec<Aov> {
        let own = match self {
            Self::Image(layer) => layer,
            Self::Grid(_) => Aov::Depth,
        };
        Aov::ALL.iter().copied().filter(|aov| *aov == Aov::Alpha || *aov == own && own != Aov::Beauty).collect()
    }
}

impl GridLayer {
    /// The last frame's picture, RGBA.
    pub fn picture(
        self,
        (context, renderer): (&Arc<Context>, &Renderer),
        image: &Layers,
        view: &View,
    ) -> Result<Vec<u8>> {
        let grid = renderer.ground().desc.grid;
        let edge = grid.edge as usize;
        let lengths = if self == Self::Lists { lengths(context, renderer)? } else { vec![] };
        let voxel_from_world = grid.voxel_from_world();
        let size = (image.width, image.height);
        let depths = image.get(Aov::Depth).unwrap_or_default();
        let color = |(pixel, depth): (usize, &[f32; 3])| {
            let Some(point) = point(view, (pixel, size), f64::from(depth[0])) else { return [0, 0, 0, 255] };
            let at = voxel_from_world.transform_point3(point);
            if at.min_element() < 0.0 || at.max_element() >= edge as f64 {
                return [128, 128, 128, 255];
            }
            let voxel = at.as_uvec3();
            match self {
                Self::Voxels(level) => color_of((voxel >> level).to_array()),
                Self::Lists => heat(longest_near(&lengths, at, edge)),
            }
        };
        Ok(depths.par_iter().enumerate().flat_map_iter(color).collect())
    }
}

/// Where a pixel's centre meets a surface that is `depth` metres ahead; `None` on the sky.
fn point(view: &View, (pixel, size): (usize, (u32, u32)), depth: f64) -> Option<DVec3> {
    let (from, direction) = view.ray(pixel, size);
    depth.is_finite().then(|| from + direction * (depth / direction.dot(view.forward)))
}

/// Of every voxel's list, x fastest.
fn lengths(context: &Arc<Context>, renderer: &Renderer) -> Result<Vec<u32>> {
    let lists = &renderer.ground().lists[0];
    let heads: Vec<u32> = download(context, &lists.heads)?;
    let items: Vec<ListItem> = download(context, &lists.items)?;
    if heads.iter().all(|&head| head == 0) {
        return Err(Error::Usage("this method keeps no lists of triangles: show another layer".into()));
    }
    // Indices are 1-based; 0 ends a list.
    let item = |at: &u32| items.get((*at as usize).checked_sub(1)?).map(|item| item.next);
    let length = |&head: &u32| std::iter::successors(Some(head), item).take_while(|&at| at != 0).count() as u32;
    Ok(heads.par_iter().map(length).collect())
}

/// A point on a surface may lie on a voxel's face: the longest list of those that it touches.
fn longest_near(lengths: &[u32], at: DVec3, edge: usize) -> u32 {
    const NEAR: f64 = 1e-3;
    let corners =
        (0..8).map(|k| at + NEAR * DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - NEAR);
    let of = |at: DVec3| {
        let [x, y, z] = at.as_uvec3().to_array().map(|c| (c as usize).min(edge - 1));
        lengths[x + edge * (y + edge * z)]
    };
    corners.map(of).max().unwrap_or(0)
}

/// Bright and apart for voxels that touch.
fn color_of([x, y, z]: [u32; 3]) -> [u8; 4] {
    let mut hash = x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B) ^ z.wrapping_mul(0xC2B2_AE35);
    hash ^= hash >> 15;
    hash = hash.wrapping_mul(0x2C1B_3C6D);
    hash ^= hash >> 13;
    let channel = |shift: u32| 80 + ((hash >> shift & 0xFF) * 175 / 255) as u8;
    [channel(0), channel(8), channel(16), 255]
}

/// In steps of two.
fn heat(length: u32) -> [u8; 4] {
    const COLORS: [[f64; 3]; 5] =
        [[0.0; 3], [40.0, 60.0, 220.0], [40.0, 220.0, 220.0], [240.0, 220.0, 40.0], [220.0, 30.0, 30.0]];
    let along = f64::from(length.max(1)).log2().min(4.0);
    let (from, part) = ((along as usize).min(3), along - along.floor().min(3.0));
    let mix = |k: usize| (COLORS[from][k] + part * (COLORS[from + 1][k] - COLORS[from][k])) as u8;
    [mix(0), mix(1), mix(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_goes_from_black_to_red_in_steps_of_two() {
        let steps = [1, 2, 4, 8, 16, 999].map(heat);
        assert_eq!(steps[0], [0, 0, 0, 255]);
        assert_eq!(steps[1], [40, 60, 220, 255]);
        assert_eq!(steps[3], [240, 220, 40, 255]);
        assert_eq!((steps[4], steps[5]), ([220, 30, 30, 255], [220, 30, 30, 255]));
    }

    #[test]
    fn voxels_that_touch_differ() {
        let colors: Vec<[u8; 4]> = (0..64).map(|k| color_of([k & 3, k >> 2 & 3, k >> 4])).collect();
        let distinct: std::collections::HashSet<_> = colors.iter().collect();
        assert_eq!(distinct.len(), 64);
    }

    #[test]
    fn a_point_on_a_face_takes_the_longer_list() {
        let mut lengths = vec![0; 8];
        (lengths[0], lengths[1]) = (2, 5);
        assert_eq!(longest_near(&lengths, DVec3::new(1.0, 0.5, 0.5), 2), 5);
        assert_eq!(longest_near(&lengths, DVec3::new(0.5, 0.5, 0.5), 2), 2);
    }
}
