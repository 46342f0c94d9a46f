//! Split: an item whose part another surface cuts in two gets a twin, so that each of the two is lit by itself.
//! Reads: lists, triangles, materials. Writes: further list items and lit items, their parts and counts.

use std::sync::Arc;

use super::Ground;
use crate::Result;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

pub struct Split {
    split: Compute,
}

impl Split {
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)]) -> Result<Self> {
        let desc = ComputeDesc { label: "split", shader: "ground/split.comp", constants };
        Ok(Self { split: Compute::new(context, &desc)? })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        recorder.zone("split", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the items that are lit were chosen
            let mut binds = ground.binds();
            binds.push(Bind::buffer("item_parts", &lists.item_parts));
            binds.push(Bind::buffer("lit_items", &lists.lit_items));
            lists.cells.dispatch_chosen(r, &self.split, binds);
        });
    }
}
