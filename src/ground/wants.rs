//! The requests of a method to the ground, and its light as debug views show it.

use super::Ground;
use super::grid::GridPlace;
use crate::settings::Conservative;
use crate::vk::{Buffer, Image, Recorder};

/// Numbers that show, coarsely, all light that a method holds.
pub enum CoarseLight<'a> {
    /// Red, green and blue of a level of an RGBA16F image.
    Image(&'a Image, u32),
    /// Red, green and blue of an RGBA32F image.
    Full(&'a Image),
    /// Whole numbers of 64 bits.
    Sums(&'a Buffer),
}

/// The requests of a method to the ground. The ground makes nothing that is not asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wants {
    /// How triangles are recorded and listed.
    pub conservative: Conservative,
    /// Whether the base grid has lists.
    pub lists: bool,
    /// Whether lists hold the voxels that the dilated triangles touch: more than the triangles do.
    pub dilated: bool,
    /// Samples a pixel, if lists instead hold the voxels into which samples of a multisampled raster fall: fewer. With
    /// [`Wants::item_samples`], which the ground then counts.
    pub sampled: Option<u32>,
    /// Exact rays, through a tree of boxes about the triangles.
    pub rays: bool,
    /// Whether the base grid has lists of its occupied cells, level by level.
    pub cells: bool,
    /// Whether the cell lists before these are kept, so that voxels that were filled there are emptied.
    pub last_cells: bool,
    /// Boxes of finer voxels within the base grid, where it would not hold the scene.
    pub nested: bool,
    /// Whether list items are lit, one by one.
    pub lit_items: bool,
    /// Whether the item of a triangle in a voxel is looked up: with [`Wants::grouped`], whose pass makes the table.
    pub indexed: bool,
    /// Whether one item is lit for all that are alike.
    pub grouped: bool,
    /// Whether two items are lit where another surface cuts the part of an item that is lit.
    pub split: bool,
    /// Whether items are lit only where something asks for their light.
    pub demand: bool,
    /// How many samples of a multisampled raster fall on each list item's part of its triangle: the method counts them,
    /// unless the lists are made of them.
    pub item_samples: bool,
    /// Words of 32 bits for the specular lobe in which each side of a list item sends direct light.
    pub lobe_words: u32,
    /// Whether direct light is kept from one pass of a frame to the next.
    pub kept_direct_light: bool,
    /// Whether each lit item also has the light that others see of it.
    pub seen_lights: bool,
    /// Whether new lists take that light over from the lists before them.
    pub carried_light: bool,
    /// Further grids with lists.
    pub grids: Vec<GridPlace>,
    /// Whether these grids also have lists of occupied cells, items that are lit, and direct light that is kept.
    pub lit_grids: bool,
    /// Whether its diffuse look-up is worth gathering apart from the image.
    pub diffuse: bool,
    /// Whether that look-up also finds light for rough lobes on the way.
    pub gathers_lobes: bool,
    /// Whether pixels are shaded triangle by triangle as a rasteriser draws them, as the talk's are, by
    /// `glsl/gi/<name>/image.frag`, and not in a compute shader.
    pub drawn: bool,
    /// Whether it has shadows of its own.
    pub shadows: bool,
    /// Whether its random numbers turn with the time of the animation, so that its light does too.
    pub turns: bool,
    /// With feedback: once it has settled, the mean of so many further passes is its light, which then stays.
    pub mean_passes: Option<u32>,
}

/// Light that is made where something asks for it.
pub trait OnDemand {
    /// Begins a list of the items whose light is asked for.
    fn begin(&self, recorder: &mut Recorder, ground: &Ground);

    /// Lights the items that were asked for since, and those that they see.
    fn light_asked(&self, recorder: &mut Recorder, ground: &Ground);

    /// Lights all items.
    fn light_all(&self, recorder: &mut Recorder, ground: &Ground);
}
