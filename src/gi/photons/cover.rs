//! Cover: a multisampled raster without attachments counts, for every item of the lists, the samples of its triangle's column
//! that lie in its voxel. No geometry shader: the vertex shader pulls the whole triangle and picks its dominant axis.
//! Reads: triangles, lists. Writes: item samples. Twin: `tests/twins/cover.rs`.
//!
//! The lists say which voxels a triangle touches, exactly; samples say how much of each it fills. What samples reach is a part
//! of what is listed, so that the pass needs no lists of its own.

use std::sync::Arc;

use super::constants::SAMPLES;
use crate::ground::Ground;
use crate::ground::constants::with;
use crate::vk::{Context, Raster, RasterDesc, Recorder, RenderTarget, SampleCountFlags, ZoneKind};
use crate::{Error, Result};

pub struct Cover {
    pipeline: Raster,
    samples: u32,
}

/// The most samples per pixel, up to `wanted`, of a raster without attachments whose samples lie where Vulkan says.
///
/// # Errors
/// Several are wanted, and the device places them as it likes.
pub fn samples(context: &Context, wanted: u32) -> Result<u32> {
    let limits = &context.limits;
    if wanted > 1 && limits.standard_sample_locations == 0 {
        return Err(Error::Device(format!(
            "{} does not say where the samples of a pixel lie: set photons.samples to 1, or choose another device",
            context.name
        )));
    }
    let offered = |count: &u32| limits.framebuffer_no_attachments_sample_counts.contains(SampleCountFlags::from_raw(*count));
    Ok([8, 4].into_iter().filter(|count| *count <= wanted).find(offered).unwrap_or(1))
}

impl Cover {
    /// # Errors
    /// As [`samples`].
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)], samples: u32) -> Result<Self> {
        let desc = RasterDesc {
            label: "cover",
            vertex: "gi/photons/cover.vert",
            fragment: Some("gi/photons/cover.frag"),
            constants: &with(constants.to_vec(), &[(SAMPLES, samples)]),
            samples,
            ..Default::default()
        };
        Ok(Self { pipeline: Raster::new(context, &desc)?, samples })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground) {
        let lists = ground.base();
        recorder.zone("cover", ZoneKind::Raster, lists.item_samples.bytes(), |r| {
            r.full_barrier(); // the lists were made; the frame before read the counts
            r.fill(&lists.item_samples, 0, lists.item_samples.bytes(), 0);
            r.full_barrier();
            let edge = lists.place.edge;
            let target = RenderTarget { width: edge, height: edge, samples: self.samples, ..Default::default() };
            r.raster(&target, |pass| {
                pass.draw(&self.pipeline, &self.pipeline.select(&ground.item_binds()), &(), ground.recorded());
            });
        });
    }
}
