//! Pass 2a, clearance: how far around every voxel nothing is listed, which rays then pass at once.
//! Reads: voxels (heads). Writes: clearance. Twin: [`codes`].

use std::sync::Arc;

use super::cells::cell_at;
use super::constants::{Features, constants};
use super::resources::{BRICK, Resources};
use crate::Result;
use crate::layout::AxisPush;
use crate::settings::Settings;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

pub struct Clearance {
    rows: Compute,
    bricks: Compute,
    reach: Compute,
    codes: Compute,
    edge: u32,
}

/// Words of bits, one per voxel: 32 to a word, or a row where that is shorter.
fn row_words(edge: u32) -> u32 {
    edge * edge * edge.div_ceil(32)
}

/// Four bits per voxel.
pub fn bytes(edge: u32) -> u64 {
    u64::from(edge.pow(3) / 2)
}

pub fn scratch_bytes(edge: u32) -> u64 {
    4 * u64::from(row_words(edge) + 2 * (edge / BRICK).pow(3))
}

impl Clearance {
    pub fn new(context: &Arc<Context>, settings: &Settings) -> Result<Self> {
        let constants = constants(settings, Features::default(), 0);
        let compute =
            |shader: &str| Compute::new(context, &ComputeDesc { label: "clearance", shader, constants: &constants });
        Ok(Self {
            rows: compute("cones/clearance_rows.comp")?,
            bricks: compute("cones/clearance_bricks.comp")?,
            reach: compute("cones/clearance_reach.comp")?,
            codes: compute("cones/clearance.comp")?,
            edge: settings.voxels,
        })
    }

    pub fn record(&self, recorder: &mut Recorder, resources: &Resources) {
        let scratch = || Bind::buffer("scratch", &resources.clearance_scratch);
        let words = [row_words(self.edge).div_ceil(64), 1, 1];
        let bricks = [(self.edge / BRICK).pow(3).div_ceil(64), 1, 1];
        recorder.zone("clearance", ZoneKind::Compute, resources.clearance.bytes(), |r| {
            r.full_barrier(); // voxelise wrote the lists; each step goes on from the one before
            r.dispatch(&self.rows, &[Bind::buffer("heads", &resources.heads), scratch()], &(), words);
            r.full_barrier();
            r.dispatch(&self.bricks, &[scratch()], &(), bricks);
            for axis in 0..3 {
                r.full_barrier();
                r.dispatch(&self.reach, &[scratch()], &AxisPush { axis }, bricks);
            }
            r.full_barrier();
            r.dispatch(&self.codes, &[scratch(), Bind::buffer("clearance", &resources.clearance)], &(), words);
        });
    }
}

/// Twin of the shaders: what `glsl/common/clearance.glsl` says of every voxel of a grid, of which some are `occupied`.
pub fn codes(occupied: &[bool], edge: u32) -> Vec<u32> {
    const MOST_NEAR: u32 = 4;
    const MOST_REACH: u32 = 12;
    let voxels = distances(occupied, edge);
    let edge_bricks = edge / BRICK;
    let brick_of = |voxel: u32| {
        let [x, y, z] = cell_at(voxel, edge).map(|k| k / BRICK);
        ((z * edge_bricks + y) * edge_bricks + x) as usize
    };
    let mut bricks = vec![false; edge_bricks.pow(3) as usize];
    (0..edge.pow(3)).filter(|&voxel| occupied[voxel as usize]).for_each(|voxel| bricks[brick_of(voxel)] = true);
    let reach = distances(&bricks, edge_bricks);
    let code = |voxel: u32| match (voxels[voxel as usize], reach[brick_of(voxel)]) {
        (near, _) if near < MOST_NEAR => near,
        (_, reach) if reach > 1 => reach.min(MOST_REACH) + MOST_NEAR - 1,
        _ => MOST_NEAR,
    };
    (0..edge.pow(3)).map(code).collect()
}

/// Chebyshev distance from every cell to the nearest that is set; u32::MAX where none is.
fn distances(set: &[bool], edge: u32) -> Vec<u32> {
    let cells: Vec<_> = (0..edge.pow(3)).filter(|&cell| set[cell as usize]).map(|cell| cell_at(cell, edge)).collect();
    let nearest = |cell| {
        let at = cell_at(cell, edge);
        cells.iter().map(|other| (0..3).map(|k| at[k].abs_diff(other[k])).max().unwrap_or(0)).min().unwrap_or(u32::MAX)
    };
    (0..edge.pow(3)).map(nearest).collect()
}
