//! Chooses the list items that are lit. Group: a voxel's triangles with one material and similar orientation form a
//! group, and the largest one is lit for all. Split: an item that another surface cuts in two gets a twin, so that both
//! sides of the cut are lit separately. Reads: lists, triangles, materials. Writes: item parts, lit items and their
//! count, and the twins among the list items. Twins: `tests/twins/item_groups.rs`, `tests/twins/split.rs`.

use std::sync::Arc;

use super::Ground;
use super::cells::{LIT_COUNTS, SECOND_COUNTS};
use super::constants::with;
use super::wants::Wants;
use crate::Result;
use crate::vk::{Bind, Compute, ComputeDesc, Constant, Context, Recorder, ZoneKind};

pub struct ItemGroups {
    choose: Compute,
    split: Option<Compute>,
    /// The pass that requests the light of all items, for light on demand.
    ask_all: Option<Compute>,
}

impl ItemGroups {
    pub fn new(context: &Arc<Context>, constants: &[Constant], wants: &Wants) -> Result<Self> {
        let constants = &with(constants.to_vec(), &[("DEMAND", u32::from(wants.demand).into())]);
        let compute = |label, shader| Compute::new(context, &ComputeDesc { label, shader, constants });
        Ok(Self {
            choose: compute("group", "ground/item_groups.comp")?,
            split: wants.split.then(|| compute("split", "ground/split.comp")).transpose()?,
            ask_all: wants.demand.then(|| compute("ask", "ground/ask_all.comp")).transpose()?,
        })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        recorder.zone("group", ZoneKind::Compute, lists.item_parts.bytes(), |r| {
            r.full_barrier(); // the voxels are listed and counted, and nothing is lit yet
            let mut binds = ground.binds();
            binds.push(Bind::buffer("item_parts", &lists.item_parts));
            binds.push(Bind::buffer("lit_items", &lists.lit_items));
            lists.cells.dispatch(r, &self.choose, binds, 0);
        });
        if self.ask_all.is_none() {
            self.split(recorder, ground, LIT_COUNTS);
        }
    }

    /// Splits those items of the list `entry` that another surface cuts.
    pub fn split(&self, recorder: &mut Recorder, ground: &Ground, entry: u32) {
        let (Some(split), lists) = (&self.split, ground.base()) else { return };
        let listed = if entry == SECOND_COUNTS { &lists.second_items } else { &lists.lit_items };
        let mut binds = ground.binds();
        binds.push(Bind::buffer("item_parts", &lists.item_parts));
        binds.push(Bind::buffer("lit_items", listed));
        binds.extend(lists.ask_binds());
        recorder.zone("split", ZoneKind::Compute, lists.item_parts.bytes(), |r| {
            r.full_barrier(); // the list was made
            lists.cells.dispatch_chosen(r, split, binds, entry);
        });
    }

    /// Requests the light of all items.
    pub fn ask_all(&self, recorder: &mut Recorder, ground: &Ground) {
        let (Some(ask_all), lists) = (&self.ask_all, ground.base()) else { return };
        recorder.zone("ask", ZoneKind::Compute, lists.asked_bytes(), |r| {
            r.full_barrier(); // the lists of items are empty
            let mut binds = ground.binds();
            binds.push(Bind::buffer("item_parts", &lists.item_parts));
            binds.extend(lists.ask_binds());
            lists.cells.dispatch(r, ask_all, binds, 0);
        });
    }
}
