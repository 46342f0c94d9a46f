//! Which list items are lit. Alike: of a voxel's triangles that have one material and face alike, the largest is lit for all.
//! Split: an item whose part another surface cuts in two gets a twin, so that each of the two is lit by itself.
//! Reads: lists, triangles, materials. Writes: item parts, lit items and their count, the twins among the list items.
//! Twins: `tests/twins/alike.rs`, `tests/twins/split.rs`.

use std::sync::Arc;

use super::Ground;
use crate::Result;
use crate::vk::{Bind, Compute, ComputeDesc, Constant, Context, Recorder, ZoneKind};

pub struct Alike {
    choose: Compute,
    split: Option<Compute>,
}

impl Alike {
    pub fn new(context: &Arc<Context>, constants: &[Constant], splits: bool) -> Result<Self> {
        let compute = |label, shader| Compute::new(context, &ComputeDesc { label, shader, constants });
        let split = splits.then(|| compute("split", "ground/split.comp")).transpose()?;
        Ok(Self { choose: compute("alike", "ground/alike.comp")?, split })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        let binds = || {
            let mut binds = ground.binds();
            binds.push(Bind::buffer("item_parts", &lists.item_parts));
            binds.push(Bind::buffer("lit_items", &lists.lit_items));
            binds
        };
        recorder.zone("alike", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the voxels are listed and counted, nothing is lit yet
            lists.cells.dispatch(r, &self.choose, binds(), 0);
        });
        if let Some(split) = &self.split {
            recorder.zone("split", ZoneKind::Compute, 0, |r| {
                r.full_barrier(); // the items that are lit were chosen
                lists.cells.dispatch_chosen(r, split, binds());
            });
        }
    }
}
