//! Alike: of a voxel's triangles that have one material and face alike, the largest is lit for all.
//! Reads: lists, triangles, materials. Writes: item parts, lit items and their count. Twin: `tests/twins/alike.rs`.

use std::sync::Arc;

use super::Ground;
use crate::Result;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

pub struct Alike {
    choose: Compute,
}

impl Alike {
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)]) -> Result<Self> {
        let desc = ComputeDesc { label: "alike", shader: "ground/alike.comp", constants };
        Ok(Self { choose: Compute::new(context, &desc)? })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        recorder.zone("alike", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the voxels are listed and counted, nothing is lit yet
            let mut binds = ground.binds();
            binds.push(Bind::buffer("item_parts", &lists.item_parts));
            binds.push(Bind::buffer("lit_items", &lists.lit_items));
            lists.cells.dispatch(r, &self.choose, binds, (0, lists.place.edge));
        });
    }
}
