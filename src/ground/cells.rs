//! Lists of the occupied cells on every level of a grid, so that passes visit only these. Reads: voxel cells, counters.
//! Writes: cell counts, parents. Twin: `tests/twins/cells.rs`.

use std::sync::Arc;

use super::layout::{LevelPush, ListCount, SharesPush};
use super::lists::Lists;
use crate::Result;
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Context, Recorder, ZoneKind};

/// The entry of the counts for lit items; as in `glsl/ground/constants.glsl`.
pub const LIT_COUNTS: u32 = 15;
/// The entry for lit items before a pass adds twins to them (`glsl/ground/split.comp`).
const CHOSEN_COUNTS: u32 = 14;
/// The entry for items that a second bounce lights, with light on demand.
pub const SECOND_COUNTS: u32 = 13;

/// The number of shares of all items into which passes that light them can be split; as in
/// `glsl/ground/constants.glsl`.
const ITEM_SHARES: u32 = 1024;

/// The occupied cells of one frame.
pub struct CellLists {
    /// Cells of the finest level, written by the voxeliser.
    pub cells: Buffer,
    /// Cells of all coarser levels, one level after another; each has room for all cells of its level.
    pub parents: Buffer,
    /// A [`ListCount`] per level, and one for lit items.
    pub counts: Buffer,
    /// Cells along the edge of the finest level.
    edge: u32,
}

impl CellLists {
    pub fn new(context: &Arc<Context>, cells: Buffer, edge: u32) -> Result<Self> {
        let buffer = |label: &str, bytes: u64| Buffer::new(context, label, bytes, BufferKind::Device);
        Ok(Self {
            cells,
            parents: buffer("parent cells", parents_bytes(edge))?,
            counts: buffer("cell counts", counts_bytes())?,
            edge,
        })
    }

    /// The list of `level` to be bound as `cells`, and the push constants of its shaders.
    pub fn level(&self, level: u32) -> (Bind<'_>, LevelPush) {
        let list = if level == 0 { &self.cells } else { &self.parents };
        (Bind::buffer("cells", list), LevelPush { level, first: first_parent(level, self.edge) })
    }

    /// Runs a thread per item of the list `entry`, in several parts, for pipelines that light items
    /// (`glsl/ground/light_items.glsl`). `binds` are additional bindings.
    pub fn light_items<'a>(
        &'a self,
        recorder: &mut Recorder,
        pipeline: &Compute,
        mut binds: Vec<Bind<'a>>,
        entry: u32,
    ) {
        binds.extend([self.level(0).0, Bind::buffer("cell_counts", &self.counts)]);
        let binds = pipeline.select(&binds);
        recorder.in_parts(ITEM_SHARES, 1, |r, shares| {
            let push = SharesPush { first: shares.start, end: shares.end };
            r.dispatch_indirect(pipeline, &binds, &push, self.counts.at(count_offset(entry)));
        });
    }

    /// Runs a thread per item of the list `entry` in one dispatch. `pipeline` may append items to the list meanwhile.
    pub fn dispatch_chosen<'a>(
        &'a self,
        recorder: &mut Recorder,
        pipeline: &Compute,
        binds: Vec<Bind<'a>>,
        entry: u32,
    ) {
        let place = |entry: u32| self.counts.at(count_offset(entry));
        recorder.copy_range(place(entry), place(CHOSEN_COUNTS), size_of::<ListCount>() as u64);
        recorder.full_barrier(); // the count no longer changes
        self.dispatch(recorder, pipeline, binds, CHOSEN_COUNTS);
    }

    /// Empties the lists of items to be lit.
    pub fn empty_items(&self, recorder: &mut Recorder) {
        for entry in [LIT_COUNTS, SECOND_COUNTS] {
            recorder.update(
                &self.counts,
                count_offset(entry),
                &[ListCount { groups_x: 0, groups_y: 1, groups_z: 1, count: 0 }],
            );
        }
    }

    /// Runs as many threads as the `entry` of the counts says: one per occupied cell of a level, or one per lit item
    /// for [`LIT_COUNTS`]. Items belong to cells of the finest level. `binds` are additional bindings.
    pub fn dispatch<'a>(&'a self, recorder: &mut Recorder, pipeline: &Compute, mut binds: Vec<Bind<'a>>, entry: u32) {
        let (list, push) = self.level(if entry < SECOND_COUNTS { entry } else { 0 });
        binds.extend([list, Bind::buffer("cell_counts", &self.counts)]);
        let binds = pipeline.select(&binds);
        recorder.dispatch_indirect(pipeline, &binds, &push, self.counts.at(count_offset(entry)));
    }
}

/// The offset of an entry of the counts in bytes.
fn count_offset(entry: u32) -> u64 {
    u64::from(entry) * size_of::<ListCount>() as u64
}

/// The index at which the list of `level` starts among the parents.
fn first_parent(level: u32, edge: u32) -> u32 {
    (1..level).map(|k| (edge >> k).pow(3)).sum()
}

pub fn parents_bytes(edge: u32) -> u64 {
    4 * u64::from(first_parent(edge.ilog2() + 1, edge))
}

pub fn counts_bytes() -> u64 {
    u64::from(LIT_COUNTS + 1) * size_of::<ListCount>() as u64
}

/// Bytes of one bit per parent.
pub fn listed_bytes(edge: u32) -> u64 {
    (parents_bytes(edge) / 32).next_multiple_of(4)
}

pub struct Cells {
    count: Compute,
    parents: Compute,
}

impl Cells {
    pub fn new(context: &Arc<Context>, constants: &[Constant]) -> Result<Self> {
        let compute = |shader: &str| Compute::new(context, &ComputeDesc { label: "cells", shader, constants });
        Ok(Self { count: compute("ground/cells_count.comp")?, parents: compute("ground/cells_parents.comp")? })
    }

    /// Counts the cells that the voxeliser listed, and lists their parents.
    pub fn record(&self, recorder: &mut Recorder, lists: &Lists) {
        let cells = &lists.cells;
        recorder.zone("cells", ZoneKind::Compute, cells.parents.bytes(), |r| {
            r.full_barrier(); // voxelise wrote the cells, and the previous frame read the lists
            r.fill(&lists.listed, 0, lists.listed.bytes(), 0);
            let counted = [
                Bind::buffer("globals", &lists.globals),
                Bind::buffer("list_items", &lists.items),
                Bind::buffer("cells", &cells.cells),
                Bind::buffer("cell_counts", &cells.counts),
            ];
            r.dispatch(&self.count, &self.count.select(&counted), &(), [1; 3]);
            r.full_barrier(); // the bits are reset, and the voxels are counted
            let binds = vec![Bind::buffer("parents", &cells.parents), Bind::buffer("listed", &lists.listed)];
            cells.dispatch(r, &self.parents, binds, 0);
        });
    }
}
