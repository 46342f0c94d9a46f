//! Cover, with `photons.voxelise` = conservative: a multisampled raster without attachments counts, for every item of
//! the ground's lists, the samples of its triangle's column that lie in its voxel. Where the lists are made of samples
//! there is no such pass. Reads: triangles, lists. Writes: item samples. Twin: `tests/twins/cover.rs`.
//!
//! The lists say which voxels a triangle touches, exactly; samples say how much of each it fills.

use std::sync::Arc;

use crate::Result;
use crate::ground::Ground;
use crate::ground::voxelise::Voxelise;
use crate::vk::{Constant, Context, RasterDesc, Recorder, ZoneKind};

pub struct Cover(Voxelise);

impl Cover {
    /// `samples`: per pixel, as many as the device has; `constants` have them too.
    ///
    /// # Errors
    /// A lost device.
    pub fn new(context: &Arc<Context>, constants: &[Constant], samples: u32) -> Result<Self> {
        let desc = RasterDesc {
            label: "cover",
            vertex: "ground/voxelise_samples.vert",
            fragment: Some("gi/photons/cover.frag"),
            constants,
            samples,
            ..Default::default()
        };
        Voxelise::made_of(context, &desc).map(Self)
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        recorder.zone("cover", ZoneKind::Raster, lists.item_samples.bytes(), |r| {
            r.full_barrier(); // the lists were made; the frame before read the counts
            r.fill(&lists.item_samples, 0, lists.item_samples.bytes(), 0);
            r.full_barrier();
            self.0.list(r, ground, lists);
        });
    }
}
