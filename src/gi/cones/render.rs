//! Pass 5, render: depth first, then every visible sample's direct light and every pixel's cones into the last bounce's
//! volume; blended triangles over it, back to front. In bands of rows, so that multisampled targets stay small.
//! Reads: triangles, lists, the last volume. Writes: radiance, f32.

use std::sync::Arc;

use super::constants::{BLENDED, Features, constants};
use super::resources::{Resources, VolumeImages};
use super::{shading_binds, volume_binds};
use crate::Result;
use crate::gpu_scene::GpuScene;
use crate::image_target::{COLOR_FORMAT, DEPTH_FORMAT, ImageTarget};
use crate::layout::BandPush;
use crate::settings::Settings;
use crate::vk::{Bind, Blend, CompareOp, Context, DepthDesc, DrawCall, Raster, RasterDesc, Recorder, ZoneKind};

pub struct Render {
    /// Whether something may be discarded.
    masked: bool,
    depth: Raster,
    opaque: Raster,
    blended: Option<Raster>,
}

impl Render {
    /// `gather`: whether there is a volume to trace cones into. `layers`: also the layers beside the image.
    pub fn new(
        context: &Arc<Context>,
        settings: &Settings,
        features: Features,
        gather: bool,
        layers: usize,
    ) -> Result<Self> {
        let base = constants(settings, features, u32::from(gather));
        let fragment = match (gather, layers > 1) {
            (true, false) => "cones/render_cones.frag",
            (true, true) => "cones/render_cones_aovs.frag",
            (false, false) => "cones/render_direct.frag",
            (false, true) => "cones/render_direct_aovs.frag",
        };
        let formats = vec![COLOR_FORMAT; layers];
        let depth = |compare, write| Some(DepthDesc { format: DEPTH_FORMAT, compare, write });
        let common = RasterDesc {
            label: "render",
            vertex: "cones/render.vert",
            samples: settings.image.samples,
            constants: &base,
            color_formats: &formats,
            ..Default::default()
        };
        let masked = features.has(Features::MASK);
        let depth_pipeline = Raster::new(
            context,
            &RasterDesc {
                label: "render depth",
                fragment: Some(if masked { "cones/depth_masked.frag" } else { "cones/depth.frag" }),
                color_write: false,
                depth: depth(CompareOp::GREATER, true),
                ..common
            },
        )?;
        let opaque = Raster::new(
            context,
            &RasterDesc { fragment: Some(fragment), depth: depth(CompareOp::EQUAL, false), ..common },
        )?;
        let with_blending: Vec<_> = base.iter().copied().chain([(BLENDED, 1)]).collect();
        let blended = RasterDesc {
            label: "render blended",
            fragment: Some(fragment),
            constants: &with_blending,
            depth: depth(CompareOp::GREATER_OR_EQUAL, false),
            blend: Some(Blend::PremultipliedOver),
            ..common
        };
        let blended = features.has(Features::BLEND).then(|| Raster::new(context, &blended)).transpose()?;
        Ok(Self { masked, depth: depth_pipeline, opaque, blended })
    }

    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        resources: &Resources,
        volume: Option<&VolumeImages>,
        target: &ImageTarget,
        blended_triangles: u32,
    ) {
        recorder.zone("render", ZoneKind::Raster, target.bytes(), |r| {
            for band in target.bands() {
                r.full_barrier(); // mips 2 wrote the volume; the band before was copied from the same targets
                r.raster(&target.render_target(&target.colors(), &band), |pass| {
                    let mut binds = shading_binds(scene, resources);
                    binds.push(Bind::buffer("slots", &resources.slots));
                    binds.push(Bind::buffer("order", &resources.order));
                    if let Some(volume) = volume {
                        binds.extend(volume_binds(volume, &resources.volume_sampler));
                    }
                    let push = BandPush { first_row: band.first_row };
                    let recorded = || DrawCall::Indirect { buffer: &resources.globals, offset: 0 };
                    if self.masked {
                        pass.draw(&self.depth, &self.depth.select(&binds), &push, recorded());
                    } else {
                        pass.draw(&self.depth, &self.depth.select(&binds), &(), recorded());
                    }
                    pass.draw(&self.opaque, &self.opaque.select(&binds), &push, recorded());
                    if let Some(pipeline) = &self.blended {
                        let call = DrawCall::Direct { vertices: 3 * blended_triangles, instances: 1 };
                        pass.draw(pipeline, &pipeline.select(&binds), &push, call);
                    }
                });
                target.copy_band(r, &band);
            }
        });
    }
}
