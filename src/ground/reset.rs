//! Reset: fills buffers without shaders. Writes: counters, voxels (heads of all lists), slots of blended triangles.

use super::Ground;
use super::layout::Globals;
use super::lists::Lists;
use crate::vk::{Recorder, ZoneKind};

impl Ground {
    /// Resets all counters, the heads of all voxels of all grids, and slots.
    pub fn reset(&self, recorder: &mut Recorder) {
        let bytes = self.lists.iter().map(|lists| lists.heads.bytes()).sum();
        recorder.zone("reset", ZoneKind::Transfer, bytes, |r| {
            for lists in &self.lists {
                r.fill(&lists.globals, 0, size_of::<Globals>() as u64, 0);
                r.fill(&lists.heads, 0, lists.heads.bytes(), 0);
            }
            r.fill(&self.slots, 0, self.slots.bytes(), 0);
            r.full_barrier();
            // The first counters are the indirect draw of the passes that fetch triangles, with one instance.
            r.fill(&self.base().globals, std::mem::offset_of!(Globals, instance_count) as u64, 4, 1);
        });
    }
}

impl Lists {
    /// Resets the counters of list items and cells, and the heads, but not the triangles.
    pub fn reset(&self, recorder: &mut Recorder) {
        recorder.zone("reset lists", ZoneKind::Transfer, self.heads.bytes(), |r| {
            r.full_barrier(); // the first bounce read the lists
            r.fill(&self.globals, std::mem::offset_of!(Globals, item_count) as u64, 8, 0);
            r.fill(&self.heads, 0, self.heads.bytes(), 0);
        });
    }
}
