//! Pass 5, render: depth first, then every visible sample's direct light and every pixel's cones into the last bounce's
//! volume; blended triangles over it, back to front. In bands of rows, so that multisampled targets stay small.
//! Diffuse light may be gathered before, apart from the image (`src/gi/cones/gather.rs`).
//! Reads: triangles, lists, the last volume. Writes: radiance, f32.

use std::sync::Arc;

use super::constants::{BLENDED, Features, constants};
use super::gather::{self, Gather};
use super::image_binds;
use super::resources::{Resources, VolumeImages};
use crate::Result;
use crate::gpu_scene::GpuScene;
use crate::image_target::{Band, COLOR_FORMAT, DEPTH_FORMAT, ImageTarget};
use crate::layout::BandPush;
use crate::settings::Settings;
use crate::vk::{Blend, CompareOp, Context, DepthDesc, DrawCall, Raster, RasterDesc, Recorder, ZoneKind};

/// An image of more bands than this is timed as one pass: a recording has room for so many zones only.
const MOST_TIMED_BANDS: usize = 100;

pub struct Render {
    /// Whether something may be discarded.
    masked: bool,
    depth: Raster,
    opaque: Raster,
    blended: Option<Raster>,
    gather: Option<Gather>,
}

impl Render {
    /// `gather`: whether there is a volume to trace cones into.
    pub fn new(
        context: &Arc<Context>,
        settings: &Settings,
        features: Features,
        gather: bool,
        target: &ImageTarget,
    ) -> Result<Self> {
        let apart = gather && gather::is_apart(settings);
        let outputs = target.outputs();
        let base = constants(settings, features, u32::from(gather));
        let cones = match (gather, outputs > 1) {
            (true, false) => "cones/render_cones.frag",
            (true, true) => "cones/render_cones_aovs.frag",
            (false, false) => "cones/render_direct.frag",
            (false, true) => "cones/render_direct_aovs.frag",
        };
        let fragment = match (apart, outputs > 1) {
            (true, false) => "cones/render_gathered.frag",
            (true, true) => "cones/render_gathered_aovs.frag",
            _ => cones,
        };
        let formats = vec![COLOR_FORMAT; outputs];
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
            fragment: Some(cones), // what lies behind was gathered, not these
            constants: &with_blending,
            depth: depth(CompareOp::GREATER_OR_EQUAL, false),
            blend: Some(Blend::PremultipliedOver),
            ..common
        };
        let blended = features.has(Features::BLEND).then(|| Raster::new(context, &blended)).transpose()?;
        let gather = apart.then(|| Gather::new(context, settings, features, target)).transpose()?;
        Ok(Self { masked, depth: depth_pipeline, opaque, blended, gather })
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
        let frame = Frame { scene, resources, volume, target, blended_triangles };
        if target.bands().count() > MOST_TIMED_BANDS {
            recorder.zone("render", ZoneKind::Raster, target.bytes(), |r| {
                for band in target.bands() {
                    self.gather_band(r, &frame, &band);
                    self.draw_band(r, &frame, &band);
                }
            });
            return;
        }
        for band in target.bands() {
            if let Some(gather) = &self.gather {
                recorder.zone("gather", ZoneKind::Raster, gather.bytes(&band), |r| self.gather_band(r, &frame, &band));
            }
            let bytes = target.bytes() / u64::from(target.height) * u64::from(band.rows);
            recorder.zone("render", ZoneKind::Raster, bytes, |r| self.draw_band(r, &frame, &band));
        }
    }

    fn gather_band(&self, r: &mut Recorder, frame: &Frame, band: &Band) {
        if let (Some(gather), Some(volume)) = (&self.gather, frame.volume) {
            gather.record(r, frame.scene, frame.resources, volume, band);
        }
    }

    fn draw_band(&self, r: &mut Recorder, frame: &Frame, band: &Band) {
        let Frame { scene, resources, volume, target, blended_triangles } = *frame;
        r.full_barrier(); // mips 2 wrote the volume, 5a and 5b what was gathered; the band before was copied from the same targets
        r.raster(&target.render_target(&target.colors(), band), |pass| {
            let mut binds = image_binds(scene, resources, volume);
            if let Some(gather) = &self.gather {
                binds.extend(gather.binds(scene));
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
        target.copy_band(r, band);
    }
}

/// What every band of a frame works on.
#[derive(Clone, Copy)]
struct Frame<'a> {
    scene: &'a GpuScene,
    resources: &'a Resources,
    volume: Option<&'a VolumeImages>,
    target: &'a ImageTarget,
    blended_triangles: u32,
}
