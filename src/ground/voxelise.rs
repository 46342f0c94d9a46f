//! Voxelise: conservative rasterisation, by a geometry shader or the hardware, with an exact triangle/voxel test, into the lists
//! of any grid.
//! Reads: triangles. Writes: list items, voxels (heads), voxel cells, counters. Twin: `tests/twins/voxelise.rs`.

use std::sync::Arc;

use super::Ground;
use super::constants::{HARDWARE, with};
use super::layout::GridPush;
use super::lists::Lists;
use crate::settings::Conservative;
use crate::vk::{Bind, Context, DrawCall, Raster, RasterDesc, Recorder, RenderTarget, ZoneKind};
use crate::{Error, Result};

pub struct Voxelise {
    pipeline: Raster,
}

impl Voxelise {
    /// `dilated`: lists what the dilated triangles touch, as in the talk.
    ///
    /// # Errors
    /// The hardware is to rasterise conservatively and cannot.
    pub fn new(
        context: &Arc<Context>,
        constants: &[(u32, u32)],
        conservative: Conservative,
        dilated: bool,
    ) -> Result<Self> {
        let hardware = conservative == Conservative::Hardware;
        if hardware && dilated {
            return Err(Error::Usage(
                "grid.conservative = hardware lists what triangles touch, but the method asks for what dilated ones touch: set \
                 grid.conservative to geometry-shader"
                    .into(),
            ));
        }
        if hardware && !context.conservative_rasterization {
            return Err(Error::Device(format!(
                "grid.conservative = hardware needs VK_EXT_conservative_rasterization, which {} does not offer: set \
                 grid.conservative to geometry-shader, or choose another device",
                context.name
            )));
        }
        let [geometry, fragment] = if dilated {
            ["ground/voxelise.geom DILATED", "ground/voxelise.frag DILATED"]
        } else {
            ["ground/voxelise.geom", "ground/voxelise.frag"]
        };
        let desc = RasterDesc {
            label: "voxelise",
            vertex: "ground/voxelise.vert",
            geometry: Some(geometry),
            fragment: Some(fragment),
            constants: &with(constants.to_vec(), &[(HARDWARE, u32::from(hardware))]),
            conservative: hardware,
            ..Default::default()
        };
        Ok(Self { pipeline: Raster::new(context, &desc)? })
    }

    /// `zone`: what the pass is called.
    pub fn record(&self, recorder: &mut Recorder, zone: &'static str, ground: &Ground, lists: &Lists) {
        recorder.zone(zone, ZoneKind::Raster, lists.items.bytes(), |r| {
            r.full_barrier(); // record wrote the triangles and the draw's count, reset the lists
            let edge = lists.place.edge;
            let target = RenderTarget { width: edge, height: edge, ..Default::default() };
            let [x, y, z, scale] = lists.place.from_base();
            let push = GridPush { offset: [x, y, z], scale };
            r.raster(&target, |pass| {
                let binds = [
                    Bind::buffer("globals", &lists.globals),
                    Bind::buffer("triangles", &ground.triangles),
                    Bind::buffer("list_items", &lists.items),
                    Bind::buffer("heads", &lists.heads),
                    Bind::buffer("cells", &lists.cells.cells),
                ];
                pass.draw(&self.pipeline, &binds, &push, ground.recorded());
            });
        });
    }
}

/// A draw of everything that was recorded.
impl Ground {
    pub fn recorded(&self) -> DrawCall<'_> {
        DrawCall::Indirect { buffer: &self.base().globals, offset: 0 }
    }
}
