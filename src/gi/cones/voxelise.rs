//! Passes 2a and 4a, voxelise: geometry-shader conservative rasterisation with an exact triangle/voxel test.
//! Reads: triangles. Writes: list items, voxels (heads), voxel cells, globals. Twin: `src/twins/voxelise.rs`.

use std::sync::Arc;

use super::Bounce;
use super::constants::{Features, constants};
use super::resources::Resources;
use crate::Result;
use crate::settings::Settings;
use crate::vk::{Bind, Context, DrawCall, Raster, RasterDesc, Recorder, RenderTarget, ZoneKind};

pub struct Voxelise {
    pipeline: Raster,
    edge: u32,
}

impl Voxelise {
    pub fn new(context: &Arc<Context>, settings: &Settings) -> Result<Self> {
        let pipeline = Raster::new(
            context,
            &RasterDesc {
                label: "voxelise",
                vertex: "cones/voxelise.vert",
                geometry: Some("cones/voxelise.geom"),
                fragment: Some("cones/voxelise.frag"),
                constants: &constants(settings, Features::default(), 0),
                ..Default::default()
            },
        )?;
        Ok(Self { pipeline, edge: settings.voxels })
    }

    pub fn record(&self, recorder: &mut Recorder, bounce: Bounce, resources: &Resources) {
        let name = bounce.pick("voxelise 1", "voxelise 2");
        recorder.zone(name, ZoneKind::Raster, resources.items.bytes(), |r| {
            r.full_barrier(); // record wrote the triangles and the draw's count, reset the lists
            let target = RenderTarget { width: self.edge, height: self.edge, ..Default::default() };
            r.raster(&target, |pass| {
                let binds = [
                    Bind::buffer("frame", &resources.frame),
                    Bind::buffer("globals", &resources.globals),
                    Bind::buffer("triangles", &resources.triangles),
                    Bind::buffer("list_items", &resources.items),
                    Bind::buffer("heads", &resources.heads),
                    Bind::buffer("cells", &resources.cells.cells),
                ];
                pass.draw(&self.pipeline, &binds, &(), DrawCall::Indirect { buffer: &resources.globals, offset: 0 });
            });
        });
    }
}
