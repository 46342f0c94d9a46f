//! Cover, with `photons.voxelise` = conservative: for every list item, a multisampled raster without attachments counts
//! the samples of its triangle's column that are in its voxel. The pass does not exist if lists are made from samples.
//! Reads: triangles, lists. Writes: item samples. Twin: `tests/twins/cover.rs`.
//!
//! The lists contain exactly the voxels that a triangle touches, and samples measure how much of each it fills.

use std::sync::Arc;

use crate::Result;
use crate::ground::Ground;
use crate::ground::voxelise::Voxelise;
use crate::vk::{Constant, Context, RasterDesc, Recorder, ZoneKind};

pub struct Cover(Voxelise);

impl Cover {
    /// `samples` is the number per pixel that the device supports, which `constants` also contain.
    ///
    /// # Errors
    /// The device is lost.
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
            r.full_barrier(); // the lists were made, and the previous frame read the counts
            r.fill(&lists.item_samples, 0, lists.item_samples.bytes(), 0);
            r.full_barrier();
            self.0.list(r, ground, lists);
        });
    }
}
