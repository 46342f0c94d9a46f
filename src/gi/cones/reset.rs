//! Passes 0 and 3, reset: fills, no shaders.
//! Writes: globals (counters), voxels (heads of all lists).

use super::resources::Resources;
use crate::layout::Globals;
use crate::vk::{Recorder, ZoneKind};

/// Pass 0: all counters, and the heads of all voxels.
pub fn all(recorder: &mut Recorder, resources: &Resources) {
    recorder.zone("reset", ZoneKind::Transfer, resources.heads.bytes(), |r| {
        r.fill(&resources.globals, 0, size_of::<Globals>() as u64, 0);
        r.fill(&resources.heads, 0, resources.heads.bytes(), 0);
        r.fill(&resources.slots, 0, resources.slots.bytes(), 0);
        r.full_barrier();
        // The counters' head is the indirect draw of the passes that fetch triangles: one instance.
        r.fill(&resources.globals, std::mem::offset_of!(Globals, instance_count) as u64, 4, 1);
    });
}

/// Pass 3: list-item and cell counters, and the heads; not the triangles.
pub fn lists(recorder: &mut Recorder, resources: &Resources) {
    recorder.zone("reset lists", ZoneKind::Transfer, resources.heads.bytes(), |r| {
        r.full_barrier(); // shade 1 read the lists
        r.fill(&resources.globals, std::mem::offset_of!(Globals, item_count) as u64, 8, 0);
        r.fill(&resources.heads, 0, resources.heads.bytes(), 0);
    });
}
