//! Layers of a frame that can be shown: those of the image, or data of the grid at visible surfaces.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use twobounce::gi::Method;
use twobounce::gi::rays::inspect::Inspect;
use twobounce::ground::layout::ListItem;
use twobounce::ground::volume::FACES;
use twobounce::layers::{Aov, Layers};
use twobounce::output::display::Display;
use twobounce::renderer::Renderer;
use twobounce::scene::View;
use twobounce::settings::Settings;
use twobounce::vk::{Context, download, download_image};
use twobounce::{Error, Result};

use super::question::{inspect, inspected};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layer {
    Image(Aov),
    Grid(GridLayer),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridLayer {
    /// Each voxel of a level in a different colour; its side is 2^level of the finest.
    Voxels(u32),
    /// The number of triangles in the voxel's list.
    Lists,
    /// Light in the voxels of the method's volume.
    Volume(Side),
    /// Light that is cached on the surface itself.
    Kept,
    /// The list items that cache this light, each in a different colour.
    Items,
}

/// The shown image of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// The bounce, 0 or 1.
    pub bounce: usize,
    pub level: u32,
    /// An index into [`SIDES`].
    pub face: usize,
}

/// Directions of travel, and their mean.
pub const SIDES: [&str; FACES] = ["+x", "+y", "+z", "-x", "-y", "-z", "mean"];

/// The number of voxel levels that can be shown.
pub const LEVELS: u32 = 5;

impl Default for Layer {
    fn default() -> Self {
        Self::BEAUTY
    }
}

impl Layer {
    pub const BEAUTY: Self = Self::Image(Aov::Beauty);

    /// All layers, those of the image first; for a volume the mean of the last bounce.
    pub fn all() -> impl Iterator<Item = Self> {
        let voxels = (0..LEVELS).map(GridLayer::Voxels);
        let volume = GridLayer::Volume(Side { bounce: 1, level: 0, face: FACES - 1 });
        let grid = voxels.chain([GridLayer::Lists, volume, GridLayer::Kept, GridLayer::Items]).map(Self::Grid);
        Aov::ALL.iter().copied().map(Self::Image).chain(grid)
    }

    /// Whether frames with these settings have it.
    pub fn is_made_with(self, settings: &Settings) -> bool {
        let Self::Grid(layer) = self else { return true };
        match layer {
            GridLayer::Voxels(_) => true,
            GridLayer::Lists => settings.method.wants(settings).lists,
            GridLayer::Volume(_) => settings.method == Method::Cones,
            GridLayer::Kept | GridLayer::Items => settings.method == Method::Rays,
        }
    }

    /// The layer by its name; for a volume, bounce from 0, level and direction may follow.
    pub fn named(name: &str) -> Option<Self> {
        let side = || {
            let [bounce, level, way] = name.strip_prefix("volume ")?.split(' ').collect::<Vec<_>>().try_into().ok()?;
            let face = SIDES.iter().position(|side| *side == way)?;
            Some(Self::Grid(GridLayer::Volume(Side { bounce: bounce.parse().ok()?, level: level.parse().ok()?, face })))
        };
        Self::all().find(|layer| layer.label().0 == name).or_else(side)
    }

    /// Its name, and the meaning of its colours.
    pub fn label(self) -> (String, &'static str) {
        let (name, meaning) = match self {
            Self::Image(layer) => (layer.name(), ""),
            Self::Grid(GridLayer::Voxels(level)) => {
                let name = if level == 0 { "voxels".into() } else { format!("voxels, level {level}") };
                return (name, "a colour per voxel; grey lies outside of the grid");
            }
            Self::Grid(GridLayer::Lists) => ("list lengths", "1 black, 2 blue, 4 cyan, 8 yellow, 16 and more red"),
            Self::Grid(GridLayer::Volume(_)) => {
                ("volume", "radiance that the voxel sends in this direction, blurred as cones read it")
            }
            Self::Grid(GridLayer::Kept) => ("light kept", "stored radiance that rays find on the surface"),
            Self::Grid(GridLayer::Items) => {
                ("where light is kept", "a colour per list item that stores light; grey items store none")
            }
        };
        (name.to_owned(), meaning)
    }

    /// The image's layers that it needs, in addition to radiance.
    pub fn needs(self) -> Vec<Aov> {
        let own = match self {
            Self::Image(layer) => layer,
            Self::Grid(_) => Aov::Depth,
        };
        if own == Aov::Beauty { vec![] } else { vec![own] }
    }
}

/// Resources for reading the last frame's grid.
pub struct Grid<'a> {
    pub context: &'a Arc<Context>,
    pub renderer: &'a Renderer,
    pub inspect: &'a mut Option<Inspect>,
    pub settings: &'a Settings,
}

impl Grid<'_> {
    /// The last frame's picture, RGBA.
    pub fn picture(&mut self, layer: GridLayer, image: &Layers, display: Display, view: &View) -> Result<Vec<u8>> {
        const OUTSIDE: [u8; 4] = [128, 128, 128, 255];
        let shown = |radiance: [f32; 3]| {
            let [r, g, b] = display.codes(radiance);
            [r, g, b, 255]
        };
        let grid = self.renderer.ground().desc.grid;
        let edge = grid.edge as usize;
        let size = (image.width, image.height);
        let of_voxel: Box<dyn Fn(DVec3) -> [u8; 4] + Sync> = match layer {
            GridLayer::Kept | GridLayer::Items => {
                let kept = self.kept(size)?;
                let scale = self.renderer.frame().scale;
                let color = |&[r, g, b, item]: &[f32; 4]| match layer {
                    GridLayer::Kept => shown([r, g, b].map(|c| c / scale)),
                    _ if item > 0.0 => color_of([item as u32, 0, 0]),
                    _ => OUTSIDE,
                };
                return Ok(kept.par_iter().flat_map_iter(color).collect());
            }
            GridLayer::Voxels(level) => Box::new(move |at| color_of((at.as_uvec3() >> level).to_array())),
            GridLayer::Lists => {
                let lengths = lengths(self.context, self.renderer)?;
                Box::new(move |at| heat(most_near(at, edge, |voxel| lengths[voxel], |&length| length as f32)))
            }
            GridLayer::Volume(side) => {
                let (texels, level) = self.volume(side)?;
                let (edge, scale) = (edge >> level, self.renderer.frame().scale);
                Box::new(move |at| {
                    let at = at / f64::from(1 << level);
                    let [r, g, b, _] = most_near(at, edge, |voxel| texels[voxel], |texel: &[f32; 4]| texel[3]);
                    shown([r, g, b].map(|c| c / scale))
                })
            }
        };
        let voxel_from_world = grid.voxel_from_world();
        let depths = image.get(Aov::Depth).unwrap_or_default();
        let color = |(pixel, depth): (usize, &[f32; 3])| {
            let Some(point) = view.surface(pixel, size, depth[0]) else {
                return [0, 0, 0, 255]; // the sky
            };
            let at = voxel_from_world.transform_point3(point);
            let outside = at.min_element() < 0.0 || at.max_element() >= edge as f64;
            if outside { OUTSIDE } else { of_voxel(at) }
        };
        Ok(depths.par_iter().enumerate().flat_map_iter(color).collect())
    }

    /// The result of [`Inspect::kept`] for every pixel.
    fn kept(&mut self, size: (u32, u32)) -> Result<Vec<[f32; 4]>> {
        let inspect = inspect(self.inspect, self.context, self.renderer, self.settings)?;
        inspect.kept(self.context, inspected(self.renderer), size)
    }

    /// The texels of a volume's image, x fastest, and their level.
    fn volume(&self, side: Side) -> Result<(Vec<[f32; 4]>, u32)> {
        let volumes = self.renderer.frame().method.volumes();
        let Some(volume) = volumes.get(side.bounce).or(volumes.last()) else {
            let method = self.settings.method;
            let words = format!("the method {method} has no directional volume: choose a preset of cones");
            return Err(Error::Usage(words));
        };
        let level = side.level.min(volume.levels - 1);
        let texels: Vec<[u16; 4]> = download_image(self.context, &volume.images[side.face], level)?;
        Ok((texels.into_iter().map(|texel| texel.map(|bits| half::f16::from_bits(bits).to_f32())).collect(), level))
    }
}

/// The lengths of all voxels' lists, x fastest.
fn lengths(context: &Arc<Context>, renderer: &Renderer) -> Result<Vec<u32>> {
    let lists = &renderer.ground().lists[0];
    let heads: Vec<u32> = download(context, &lists.heads)?;
    let items: Vec<ListItem> = download(context, &lists.items)?;
    if heads.iter().all(|&head| head == 0) {
        return Err(Error::Usage("this method has no lists of triangles: show another layer".into()));
    }
    // Indices are 1-based; 0 ends a list.
    let item = |at: &u32| items.get((*at as usize).checked_sub(1)?).map(|item| item.next);
    let length = |&head: &u32| std::iter::successors(Some(head), item).take_while(|&at| at != 0).count() as u32;
    Ok(heads.par_iter().map(length).collect())
}

/// A point on a surface may lie on a voxel's face: the largest value of the voxels that it touches.
fn most_near<T>(at: DVec3, edge: usize, of: impl Fn(usize) -> T, most: impl Fn(&T) -> f32) -> T {
    const NEAR: f64 = 1e-3;
    let corner =
        |k: i32| at + NEAR * DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - NEAR;
    let voxel = |at: DVec3| {
        let [x, y, z] = at.as_uvec3().to_array().map(|c| (c as usize).min(edge - 1));
        of(x + edge * (y + edge * z))
    };
    let touched = (0..8).map(|k| voxel(corner(k)));
    touched.max_by(|a, b| most(a).total_cmp(&most(b))).expect("eight corners")
}

/// A bright colour that differs between neighbouring voxels.
fn color_of([x, y, z]: [u32; 3]) -> [u8; 4] {
    let mut hash = x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B) ^ z.wrapping_mul(0xC2B2_AE35);
    hash ^= hash >> 15;
    hash = hash.wrapping_mul(0x2C1B_3C6D);
    hash ^= hash >> 13;
    let channel = |shift: u32| 80 + ((hash >> shift & 0xFF) * 175 / 255) as u8;
    [channel(0), channel(8), channel(16), 255]
}

/// A colour for a length, in steps of two.
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
    fn layers_are_offered_where_frames_have_them() {
        let offered = |method: &str| {
            let mut settings = Settings::default();
            settings.set(&format!("method={method}")).unwrap();
            let names = Layer::all().filter(|layer| layer.is_made_with(&settings)).map(|layer| layer.label().0);
            // Every frame has the layers of the image, and voxels.
            let is_of_method =
                |name: &String| !name.starts_with("voxels") && !Aov::ALL.iter().any(|aov| aov.name() == *name);
            names.filter(is_of_method).collect::<Vec<_>>().join(", ")
        };
        let found = ["none", "cones", "rays", "lpv", "photons", "probes"].map(offered);
        let of_rays = "list lengths, light kept, where light is kept";
        assert_eq!(found, ["", "list lengths, volume", of_rays, "", "list lengths", ""]);
    }

    #[test]
    fn heat_goes_from_black_to_red_in_steps_of_two() {
        let steps = [1, 2, 4, 8, 16, 999].map(heat);
        assert_eq!(steps[0], [0, 0, 0, 255]);
        assert_eq!(steps[1], [40, 60, 220, 255]);
        assert_eq!(steps[3], [240, 220, 40, 255]);
        assert_eq!((steps[4], steps[5]), ([220, 30, 30, 255], [220, 30, 30, 255]));
    }

    #[test]
    fn a_point_on_a_face_takes_the_longer_list() {
        let mut lengths = [0; 8];
        (lengths[0], lengths[1]) = (2, 5);
        let longest = |at| most_near(at, 2, |voxel| lengths[voxel], |&length| length as f32);
        assert_eq!(longest(DVec3::new(1.0, 0.5, 0.5)), 5);
        assert_eq!(longest(DVec3::new(0.5, 0.5, 0.5)), 2);
    }
}
