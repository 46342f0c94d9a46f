//! Pass 2a, clearance: how far around every voxel nothing is listed, which rays then pass at once.
//! Reads: voxels (heads). Writes: clearance. Twin: [`codes`].

use std::sync::Arc;

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
