//! Passes 2b and 4b, shade: one triangle over the screen per slice; each voxel shades its list into seven targets.
//! Reads: lists, triangles, materials, lights; 4b the first bounce's volume. Writes: level 0 of a volume, premultiplied
//! stored radiance. Twin of the fill: `src/twins/shade.rs`.

use std::sync::Arc;

use super::constants::{Features, constants};
use super::resources::{FACES, Resources, VOLUME_FORMAT, VolumeImages};
use super::{Bounce, layered_target, shading_binds, volume_binds};
use crate::Result;
use crate::gpu_scene::GpuScene;
use crate::settings::Settings;
use crate::vk::{Context, DrawCall, Raster, RasterDesc, Recorder, ZoneKind};

pub struct Shade {
    pipeline: Raster,
    bounce: Bounce,
}

impl Shade {
    /// `gathers`: whether there is a volume to gather from.
    pub fn new(
        context: &Arc<Context>,
        settings: &Settings,
        features: Features,
        bounce: Bounce,
        gathers: bool,
    ) -> Result<Self> {
        let pipeline = Raster::new(
            context,
            &RasterDesc {
                label: bounce.pick("shade 1", "shade 2"),
                vertex: "cones/layered.vert",
                fragment: Some(if gathers { "cones/shade_second.frag" } else { "cones/shade_first.frag" }),
                constants: &constants(&settings.of_voxels(), features, u32::from(gathers)),
                color_formats: &[VOLUME_FORMAT; FACES],
                ..Default::default()
            },
        )?;
        Ok(Self { pipeline, bounce })
    }

    /// `previous`: the volume to gather from.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        resources: &Resources,
        target: &VolumeImages,
        previous: Option<&VolumeImages>,
    ) {
        let bytes = 8 * FACES as u64 * u64::from(target.edge).pow(3);
        recorder.zone(self.bounce.pick("shade 1", "shade 2"), ZoneKind::Raster, bytes, |r| {
            r.full_barrier(); // voxelise wrote the lists, mips 1 the volume that is gathered from
            r.raster(&layered_target(&target.colors(0), target.edge), |pass| {
                let mut binds = shading_binds(scene, resources);
                if let Some(volume) = previous {
                    binds.extend(volume_binds(volume, &resources.volume_sampler));
                }
                let call = DrawCall::Direct { vertices: 3, instances: target.edge };
                pass.draw(&self.pipeline, &binds, &(), call);
            });
        });
    }
}
