//! Lists of the occupied cells of every level, for the `cells` form of shading and mips; and the emptying of what such
//! a list filled in the frame before, so that no pass has to go through the whole grid.
//! Reads: voxel cells, globals. Writes: cell counts, parents; emptying: the volumes. Twin: [`parents`].

use std::collections::BTreeSet;
use std::sync::Arc;

use super::constants::{Features, constants};
use super::resources::{Resources, VolumeImages};
use super::{Bounce, face_binds};
use crate::Result;
use crate::layout::{CellCount, LevelPush};
use crate::settings::{Settings, Work};
use crate::vk::{Bind, Buffer, BufferKind, BufferUsageFlags, Compute, ComputeDesc, Context, Recorder, ZoneKind};

/// Where the count of the items that are lit stands among those of the levels; as in `glsl/common/constants.glsl`.
pub const LIT_COUNTS: u32 = 15;
/// Of 64 threads; each goes through many cells, most of which are occupied again.
const EMPTYING_GROUPS: u32 = 16;

/// The occupied cells of one frame.
pub struct CellLists {
    /// Of the finest level, by the voxeliser.
    pub cells: Buffer,
    /// Of all coarser levels, one after the other; each has room for all of its level.
    pub parents: Buffer,
    /// A [`CellCount`] per level, and one of the lists' items that are lit.
    pub counts: Buffer,
}

impl CellLists {
    pub fn new(context: &Arc<Context>, cells: (&str, u64), edge: u32) -> Result<Self> {
        let buffer =
            |label: &str, bytes: u64| Buffer::new(context, label, bytes, BufferKind::Device, BufferUsageFlags::empty());
        Ok(Self {
            cells: buffer(cells.0, cells.1)?,
            parents: buffer("parent cells", parents_bytes(edge))?,
            counts: buffer("cell counts", counts_bytes())?,
        })
    }

    /// The list of `level`, to be bound as `cells`, and what its shaders are told.
    fn level(&self, level: u32, edge: u32) -> (Bind<'_>, LevelPush) {
        let list = if level == 0 { &self.cells } else { &self.parents };
        (Bind::buffer("cells", list), LevelPush { level, first: first_parent(level, edge) })
    }

    /// A thread per item that is lit. `binds`: besides the lists.
    pub fn dispatch_items<'a>(&'a self, recorder: &mut Recorder, pipeline: &Compute, binds: Vec<Bind<'a>>) {
        self.dispatch_counted(recorder, pipeline, binds, LIT_COUNTS, self.level(0, 1));
    }

    /// A thread per occupied cell of `level`. `binds`: besides the lists.
    pub fn dispatch<'a>(
        &'a self,
        recorder: &mut Recorder,
        pipeline: &Compute,
        binds: Vec<Bind<'a>>,
        (level, edge): (u32, u32),
    ) {
        self.dispatch_counted(recorder, pipeline, binds, level, self.level(level, edge));
    }

    /// As many threads as the `entry` of the counts says.
    fn dispatch_counted<'a>(
        &'a self,
        recorder: &mut Recorder,
        pipeline: &Compute,
        mut binds: Vec<Bind<'a>>,
        entry: u32,
        (list, push): (Bind<'a>, LevelPush),
    ) {
        binds.extend([list, Bind::buffer("cell_counts", &self.counts)]);
        let offset = u64::from(entry) * size_of::<CellCount>() as u64;
        let binds = pipeline.select(&binds);
        if pipeline.push_bytes() == 0 {
            recorder.dispatch_indirect(pipeline, &binds, &(), &self.counts, offset);
        } else {
            recorder.dispatch_indirect(pipeline, &binds, &push, &self.counts, offset);
        }
    }
}

/// Where the list of `level` starts among the parents.
fn first_parent(level: u32, edge: u32) -> u32 {
    (1..level).map(|k| (edge >> k).pow(3)).sum()
}

pub fn parents_bytes(edge: u32) -> u64 {
    4 * u64::from(first_parent(edge.ilog2() + 1, edge))
}

pub fn counts_bytes() -> u64 {
    u64::from(LIT_COUNTS + 1) * size_of::<CellCount>() as u64
}

/// A bit per parent.
pub fn listed_bytes(edge: u32) -> u64 {
    (parents_bytes(edge) / 32).next_multiple_of(4)
}

pub struct Cells {
    count: Compute,
    parents: Compute,
    empty: Compute,
    emptied: std::ops::Range<u32>,
    edge: u32,
}

impl Cells {
    pub fn new(context: &Arc<Context>, settings: &Settings) -> Result<Self> {
        let constants = constants(settings, Features::default(), 0);
        let compute =
            |shader: &str| Compute::new(context, &ComputeDesc { label: "cells", shader, constants: &constants });
        let levels = settings.voxels.ilog2() + 1;
        Ok(Self {
            count: compute("cones/cells_count.comp")?,
            parents: compute("cones/cells_parents.comp")?,
            empty: compute("cones/empty.comp")?,
            emptied: match (settings.shading, settings.mips) {
                (Work::Cells, Work::Cells) => 0..levels,
                (Work::Cells, Work::Raster) => 0..1,
                (Work::Raster, _) => 1..levels,
            },
            edge: settings.voxels,
        })
    }

    /// Counts the cells that the voxeliser listed, and lists their parents.
    pub fn list(&self, recorder: &mut Recorder, resources: &Resources) {
        let lists = &resources.cells;
        recorder.zone("cells", ZoneKind::Compute, lists.parents.bytes(), |r| {
            r.full_barrier(); // voxelise wrote the cells, the frame before read the lists
            r.fill(&resources.listed, 0, resources.listed.bytes(), 0);
            let counts = Bind::buffer("cell_counts", &lists.counts);
            let counted =
                [Bind::buffer("frame", &resources.frame), Bind::buffer("globals", &resources.globals), counts];
            r.dispatch(&self.count, &counted, &(), [1; 3]);
            r.full_barrier(); // the bits are reset, the voxels counted
            let binds = vec![Bind::buffer("parents", &lists.parents), Bind::buffer("listed", &resources.listed)];
            lists.dispatch(r, &self.parents, binds, (0, self.edge));
        });
    }

    /// Empties the cells that the frame before filled and this one does not; all of them where it is not `known` which.
    pub fn empty(
        &self,
        recorder: &mut Recorder,
        bounce: Bounce,
        resources: &Resources,
        volume: &VolumeImages,
        known: bool,
    ) {
        recorder.zone(bounce.pick("empty 1", "empty 2"), ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the cells are listed; somebody may have read the volume
            if !known {
                volume.faces.iter().for_each(|face| r.clear(face));
                return;
            }
            for level in self.emptied.clone() {
                let (list, push) = resources.last_cells.level(level, self.edge);
                let lists = [
                    list,
                    Bind::buffer("cell_counts", &resources.last_cells.counts),
                    Bind::buffer("heads", &resources.heads),
                    Bind::buffer("listed", &resources.listed),
                ];
                let binds: Vec<Bind> = lists.into_iter().chain(face_binds(volume, level)).collect();
                r.dispatch(&self.empty, &binds, &push, [EMPTYING_GROUPS, 1, 1]);
            }
        });
    }
}

/// Twin of the function in `glsl/common/heads.glsl`: column, row and slice of a cell of a grid of edge `edge`.
pub(super) fn cell_at(cell: u32, edge: u32) -> [u32; 3] {
    [cell % edge, cell / edge % edge, cell / edge / edge]
}

/// Twin of the parents' shader: the cells of each level of a grid of edge `edge` that have an occupied voxel of `cells` in them.
pub fn parents(cells: &[u32], edge: u32) -> Vec<BTreeSet<u32>> {
    let at = |cell: u32, level: u32| {
        let [x, y, z] = cell_at(cell, edge);
        let edge = edge >> level;
        ((z >> level) * edge + (y >> level)) * edge + (x >> level)
    };
    (0..=edge.ilog2()).map(|level| cells.iter().map(|&cell| at(cell, level)).collect()).collect()
}
