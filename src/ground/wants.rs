//! The requests of a method to the ground, and the method's light for debug views.

use super::Ground;
use super::grid::GridPlace;
use crate::settings::Conservative;
use crate::vk::{Buffer, Image, Recorder};

/// Numbers that coarsely represent all light that a method stores.
pub enum CoarseLight<'a> {
    /// Red, green and blue of a level of an RGBA16F image.
    Image(&'a Image, u32),
    /// Red, green and blue of an RGBA32F image.
    Full(&'a Image),
    /// Integers of 64 bits.
    Sums(&'a Buffer),
}

/// The requests of a method to the ground, which makes nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wants {
    /// How triangles are recorded and listed.
    pub conservative: Conservative,
    /// Whether the base grid has lists.
    pub lists: bool,
    /// Whether lists contain the voxels that dilated triangles touch, which are more than the triangles do.
    pub dilated: bool,
    /// Samples per pixel, if lists contain the voxels with samples of a multisampled raster instead, which are fewer.
    /// This needs [`Wants::item_samples`], which the ground then counts.
    pub sampled: Option<u32>,
    /// Whether exact rays are traced.
    pub rays: bool,
    /// Whether the base grid has lists of its occupied cells on each level.
    pub cells: bool,
    /// Whether the previous cell lists are kept, so that their voxels can be emptied.
    pub last_cells: bool,
    /// Whether the base grid may have boxes of finer voxels if it would not contain the scene.
    pub nested: bool,
    /// Whether list items are lit individually.
    pub lit_items: bool,
    /// Whether items are looked up by triangle and voxel. This needs [`Wants::grouped`], whose pass makes the index.
    pub indexed: bool,
    /// Whether one item is lit for each group of a voxel's similar triangles.
    pub grouped: bool,
    /// Whether a lit item that another surface cuts becomes two.
    pub split: bool,
    /// Whether items are lit only on request.
    pub demand: bool,
    /// Whether the samples of a multisampled raster on each item's triangle are counted: by the method, unless lists
    /// are made from samples.
    pub item_samples: bool,
    /// 32-bit words for the specular lobe of direct light on each side of a list item.
    pub lobe_words: u32,
    /// Whether direct light is kept from one pass of a frame to the next.
    pub kept_direct_light: bool,
    /// Whether each lit item also stores its light as others receive it.
    pub seen_lights: bool,
    /// Whether new lists take over that light from the previous lists.
    pub carried_light: bool,
    /// Further grids with lists.
    pub grids: Vec<GridPlace>,
    /// Whether these grids also have lists of occupied cells, lit items, and kept direct light.
    pub lit_grids: bool,
    /// Whether it is worth gathering the method's diffuse look-up in passes before the image.
    pub diffuse: bool,
    /// Whether that look-up also finds light for rough lobes.
    pub gathers_lobes: bool,
    /// Whether pixels are shaded triangle by triangle by a rasteriser, as in the talk, with `glsl/gi/<name>/image.frag`
    /// instead of a compute shader.
    pub drawn: bool,
    /// Whether the method computes all light of a visible surface by itself: `METHOD_SHADES` in its look-up.
    pub shades: bool,
    /// Whether the method has its own shadows.
    pub shadows: bool,
    /// Whether its random numbers, and so its light, change with the time of the animation.
    pub turns: bool,
    /// The number of passes, after feedback has settled, whose mean is the final light.
    pub mean_passes: Option<u32>,
}

/// Light that is computed on request.
pub trait OnDemand {
    /// Begins an empty list of requested items.
    fn begin(&self, recorder: &mut Recorder, ground: &Ground);

    /// Lights the items that were requested since then, and those that they see.
    fn light_asked(&self, recorder: &mut Recorder, ground: &Ground);

    /// Lights all items.
    fn light_all(&self, recorder: &mut Recorder, ground: &Ground);
}
