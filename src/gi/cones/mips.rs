//! Passes 2c and 4c, mips: level by level, six directional preintegrations and one plain average. Layered passes cover
//! all cells of a level, with one triangle over the screen per slice. Cell passes (`src/ground/cell_passes.rs`) cover
//! the parents of occupied cells. Reads: level k − 1. Writes: level k. Twin: `tests/twins/mips.rs`.

use std::sync::Arc;

use super::choices::Passes;
use super::layered;
use crate::Result;
use crate::ground::Ground;
use crate::ground::cell_passes::MipCells;
use crate::ground::volume::LightVolume;
use crate::vk::{Constant, Context, Raster, Recorder, ZoneKind};

pub enum Mips {
    Layered(Raster),
    Cells(MipCells),
}

impl Mips {
    pub fn new(context: &Arc<Context>, passes: Passes, constants: &[Constant]) -> Result<Self> {
        Ok(match passes {
            Passes::Layered => Self::Layered(layered(context, "mips", "gi/cones/mips.frag", constants)?),
            Passes::Cells => Self::Cells(MipCells::new(context, "cones", &[""], constants)?),
        })
    }

    pub fn record(&self, r: &mut Recorder, ground: &Ground, volume: &LightVolume) {
        let pipeline = match self {
            Self::Layered(pipeline) => pipeline,
            Self::Cells(mips) => return mips.record(r, ground, volume),
        };
        r.zone(volume.mips_zone(), ZoneKind::Raster, volume.bytes(1..volume.levels), |r| {
            for level in 1..volume.levels {
                r.full_barrier(); // shade or the previous level wrote it
                volume.draw(r, pipeline, &volume.sources(level), level);
                r.end_step();
            }
        });
    }
}
