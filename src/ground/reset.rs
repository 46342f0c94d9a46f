//! Reset: fills, no shaders.
//! Writes: counters, voxels (heads of all lists), slots of blended triangles.

use super::Ground;
use super::layout::Globals;
use super::lists::Lists;
use crate::vk::{Recorder, ZoneKind};

/// All counters, and the heads of all voxels of all grids.
pub fn all(recorder: &mut Recorder, ground: &Ground) {
    let bytes = ground.lists.iter().map(|lists| lists.heads.bytes()).sum();
    recorder.zone("reset", ZoneKind::Transfer, bytes, |r| {
        for lists in &ground.lists {
            r.fill(&lists.globals, 0, size_of::<Globals>() as u64, 0);
            r.fill(&lists.heads, 0, lists.heads.bytes(), 0);
        }
        r.fill(&ground.slots, 0, ground.slots.bytes(), 0);
        r.full_barrier();
        // The counters' head is the indirect draw of the passes that fetch triangles: one instance.
        r.fill(&ground.base().globals, std::mem::offset_of!(Globals, instance_count) as u64, 4, 1);
    });
}

/// Counters of list items and cells, and the heads; not the triangles.
pub fn lists(recorder: &mut Recorder, lists: &Lists) {
    recorder.zone("reset lists", ZoneKind::Transfer, lists.heads.bytes(), |r| {
        r.full_barrier(); // the first bounce read the lists
        r.fill(&lists.globals, std::mem::offset_of!(Globals, item_count) as u64, 8, 0);
        r.fill(&lists.heads, 0, lists.heads.bytes(), 0);
    });
}
