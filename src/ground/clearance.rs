//! Clearance: how far around every voxel nothing is listed, which rays then pass at once.
//! Reads: voxels (heads). Writes: clearance. Twin: `tests/twins/cells.rs`.

use std::sync::Arc;

use super::layout::AxisPush;
use super::lists::Lists;
use crate::Result;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

/// Voxels along the edge of a brick, as in `glsl/ground/constants.glsl`.
pub const BRICK: u32 = 4;

pub struct Clearance {
    rows: Compute,
    bricks: Compute,
    reach: Compute,
    codes: Compute,
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
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)]) -> Result<Self> {
        let compute = |shader: &str| Compute::new(context, &ComputeDesc { label: "clearance", shader, constants });
        Ok(Self {
            rows: compute("ground/clearance_rows.comp")?,
            bricks: compute("ground/clearance_bricks.comp")?,
            reach: compute("ground/clearance_reach.comp")?,
            codes: compute("ground/clearance.comp")?,
        })
    }

    pub fn record(&self, recorder: &mut Recorder, lists: &Lists) {
        let edge = lists.place.edge;
        let scratch = || Bind::buffer("scratch", &lists.clearance_scratch);
        let words = [row_words(edge).div_ceil(64), 1, 1];
        let bricks = [(edge / BRICK).pow(3).div_ceil(64), 1, 1];
        recorder.zone("clearance", ZoneKind::Compute, lists.clearance.bytes(), |r| {
            r.full_barrier(); // voxelise wrote the lists; each step goes on from the one before
            r.dispatch(&self.rows, &[Bind::buffer("heads", &lists.heads), scratch()], &(), words);
            r.full_barrier();
            r.dispatch(&self.bricks, &[scratch()], &(), bricks);
            for axis in 0..3 {
                r.full_barrier();
                r.dispatch(&self.reach, &[scratch()], &AxisPush { axis }, bricks);
            }
            r.full_barrier();
            r.dispatch(&self.codes, &[scratch(), Bind::buffer("clearance", &lists.clearance)], &(), words);
        });
    }
}
