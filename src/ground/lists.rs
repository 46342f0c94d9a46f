//! The lists of one grid: the triangles that touch each voxel, the occupied voxels, and data derived from them.

use std::sync::Arc;

use super::boxes::MOST_BOXES;
use super::cells::{self, CellLists};
use super::grid::GridPlace;
use super::layout;
use super::memory_plan::{MemoryRow, bytes_of};
use super::wants::Wants;
use crate::Result;
use crate::vk::{Bind, Buffer, BufferKind, Context};

/// Capacities of a grid's buffers in list items and occupied voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListCapacity {
    pub items: u32,
    pub cells: u32,
    /// The number of boxes of finer voxels within the grid.
    pub boxes: u32,
}

/// The buffers of a grid.
pub struct Lists {
    pub place: GridPlace,
    /// Least corners of the boxes of finer voxels, in voxels of the grid.
    pub boxes: [[f32; 3]; MOST_BOXES],
    /// Least corners of the boxes when the current lists were made.
    pub made_boxes: [[f32; 3]; MOST_BOXES],
    /// Counters of items and cells; those of the base grid also count recorded triangles.
    pub globals: Buffer,
    pub items: Buffer,
    /// The first item of every voxel's list, 1-based. If a method requests it, an index from triangle and voxel to item
    /// follows (`glsl/ground/item_index.glsl`).
    pub heads: Buffer,
    /// The number of voxels of the grid and its boxes, and of heads.
    pub voxels: u32,
    /// Cells that are occupied in this frame.
    pub cells: CellLists,
    /// Cells that were occupied in the previous frame.
    pub last_cells: CellLists,
    /// A bit per cell of every level except the first: whether the cell is in its list.
    pub listed: Buffer,
    /// Light that each list item reflects and emits.
    pub item_lights: Buffer,
    /// For each list item, the item whose light it copies.
    pub item_parts: Buffer,
    /// Samples of a multisampled raster that fall on each list item.
    pub item_samples: Buffer,
    /// Specular lobes of both sides of each list item.
    pub item_lobes: Buffer,
    /// Direct light of both sides of each list item, kept from one pass to the next.
    pub direct_light: Buffer,
    /// Light of each list item as other surfaces receive it.
    pub seen_lights: Buffer,
    /// Specular lobes of that light, if light continues from frame to frame.
    pub seen_lobes: Buffer,
    /// The items that are lit, if one item is lit for each group.
    pub lit_items: Buffer,
    /// The items that a second bounce lights, and the requests for each item, with light on demand.
    pub second_items: Buffer,
    pub asked_items: Buffer,
    /// Heads of the previous lists. Light is carried over from them by triangle and voxel.
    pub last_heads: Buffer,
    pub last_items: Buffer,
    pub last_item_parts: Buffer,
    pub last_seen_lights: Buffer,
}

impl Lists {
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, place: GridPlace, wants: &Wants, capacity: ListCapacity) -> Result<Self> {
        let plan = plan(place.edge, wants, capacity);
        let buffer = |name: &str| Buffer::new(context, name, bytes_of(&plan, name), BufferKind::Device);
        let edge_of = |wanted: bool| if wanted { place.edge } else { 1 };
        Ok(Self {
            place,
            boxes: [[0.0; 3]; MOST_BOXES],
            made_boxes: [[0.0; 3]; MOST_BOXES],
            globals: buffer("globals")?,
            items: buffer("list items")?,
            heads: buffer("voxels")?,
            voxels: voxels(place.edge, capacity),
            cells: CellLists::new(context, buffer("voxel cells")?, edge_of(wants.cells))?,
            last_cells: CellLists::new(context, buffer("last voxel cells")?, edge_of(wants.last_cells))?,
            listed: buffer("listed parents")?,
            item_lights: buffer("item lights")?,
            item_parts: buffer("item parts")?,
            item_samples: buffer("item samples")?,
            item_lobes: buffer("item lobes")?,
            direct_light: buffer("direct light")?,
            seen_lights: buffer("seen lights")?,
            seen_lobes: buffer("seen lobes")?,
            lit_items: buffer("lit items")?,
            second_items: buffer("second items")?,
            asked_items: buffer("asked items")?,
            last_heads: buffer("last voxels")?,
            last_items: buffer("last list items")?,
            last_item_parts: buffer("last item parts")?,
            last_seen_lights: buffer("last seen lights")?,
        })
    }

    /// Replaces buffers that are too small for `capacity`.
    ///
    /// # Errors
    /// Too little memory.
    pub fn grow(&mut self, context: &Arc<Context>, wants: &Wants, capacity: ListCapacity) -> Result<()> {
        let plan = plan(self.place.edge, wants, capacity);
        let of_items = [&mut self.items, &mut self.item_lights, &mut self.item_parts, &mut self.direct_light];
        let others = [
            &mut self.heads,
            &mut self.last_heads,
            &mut self.item_samples,
            &mut self.item_lobes,
            &mut self.seen_lobes,
            &mut self.lit_items,
            &mut self.second_items,
            &mut self.asked_items,
            &mut self.cells.cells,
            &mut self.last_cells.cells,
        ];
        let last = [&mut self.last_items, &mut self.last_item_parts, &mut self.last_seen_lights, &mut self.seen_lights];
        for buffer in of_items.into_iter().chain(others).chain(last) {
            let bytes = bytes_of(&plan, buffer.label());
            grow(context, buffer, bytes)?;
        }
        Ok(())
    }

    /// Bindings of passes that request the light of items, in addition to the counts.
    pub fn ask_binds(&self) -> [Bind<'_>; 3] {
        [
            Bind::buffer("asked_items", &self.asked_items),
            Bind::buffer("first_items", &self.lit_items),
            Bind::buffer("second_items", &self.second_items),
        ]
    }

    /// The maximum number of bytes that a pass writes to request the light of items.
    pub fn asked_bytes(&self) -> u64 {
        self.asked_items.bytes() + self.lit_items.bytes() + self.second_items.bytes()
    }

    /// Exchanges the current lists and the previous ones, which are overwritten next.
    pub fn swap(&mut self, wants: &Wants) {
        self.made_boxes = self.boxes;
        if wants.last_cells {
            std::mem::swap(&mut self.cells, &mut self.last_cells);
        }
        if wants.carried_light {
            std::mem::swap(&mut self.heads, &mut self.last_heads);
            std::mem::swap(&mut self.items, &mut self.last_items);
            std::mem::swap(&mut self.item_parts, &mut self.last_item_parts);
            std::mem::swap(&mut self.seen_lights, &mut self.last_seen_lights);
        }
    }
}

/// Replaces a buffer that is smaller than `bytes`.
///
/// # Errors
/// There is too little memory; the buffer is then unchanged.
pub fn grow(context: &Arc<Context>, buffer: &mut Buffer, bytes: u64) -> Result<()> {
    if bytes > buffer.bytes() {
        *buffer = Buffer::new(context, buffer.label(), bytes, BufferKind::Device)?;
    }
    Ok(())
}

/// Bytes of `count` elements, at least one.
pub fn array<T>(count: u32) -> u64 {
    u64::from(count.max(1)) * size_of::<T>() as u64
}

/// The number of places of an index in which `items` take at most two thirds: a power of two. Below 128 MiB it can then
/// hold as many items as their list.
fn index_places(items: u32) -> u32 {
    items.saturating_add(items / 2).checked_next_power_of_two().unwrap_or(1 << 31)
}

/// The number of voxels of a grid and its boxes.
fn voxels(edge: u32, capacity: ListCapacity) -> u32 {
    (1 + capacity.boxes) * edge.pow(3)
}

/// Memory of [`Lists::new`].
pub fn plan(edge: u32, wants: &Wants, capacity: ListCapacity) -> Vec<MemoryRow> {
    let items = |needed: bool| if needed { capacity.items } else { 1 };
    let lobes = |words: u32| u64::from(words.max(1)) * array::<[u32; 2]>(items(words > 0));
    let listed = |count: u32| if wants.lists { count } else { 1 };
    let edge_of = |wanted: bool| if wanted { edge } else { 1 };
    let index = if wants.indexed { index_places(capacity.items) } else { 0 };
    let heads = voxels(edge, capacity).saturating_add(index);
    let last_cells = if wants.last_cells { capacity.cells } else { 1 };
    let parents = cells::parents_bytes(edge_of(wants.cells)) + cells::parents_bytes(edge_of(wants.last_cells));
    let last_items = items(wants.carried_light);
    vec![
        ("globals", array::<layout::Globals>(1)),
        ("list items", array::<layout::ListItem>(listed(capacity.items))),
        ("item lights", array::<layout::ItemLight>(items(wants.lit_items))),
        ("item parts", array::<layout::ItemPart>(items(wants.grouped))),
        ("lit items", array::<u32>(items(wants.grouped))),
        ("second items", array::<u32>(items(wants.demand))),
        ("asked items", array::<u32>(items(wants.demand))),
        ("item samples", array::<u32>(items(wants.item_samples))),
        ("item lobes", lobes(wants.lobe_words)),
        ("seen lobes", lobes(if wants.carried_light { wants.lobe_words } else { 0 })),
        ("direct light", array::<[[f32; 3]; 2]>(items(wants.kept_direct_light))),
        ("seen lights", array::<layout::ItemLight>(items(wants.seen_lights))),
        ("last list items", array::<layout::ListItem>(last_items)),
        ("last item parts", array::<layout::ItemPart>(last_items)),
        ("last seen lights", array::<layout::ItemLight>(last_items)),
        ("last voxels", array::<u32>(if wants.carried_light { heads } else { 1 })),
        ("voxels", array::<u32>(listed(heads))),
        ("voxel cells", array::<u32>(listed(capacity.cells))),
        ("last voxel cells", array::<u32>(last_cells)),
        ("listed parents", cells::listed_bytes(edge_of(wants.cells))),
        ("parent cells", parents + 2 * cells::counts_bytes()),
    ]
}
