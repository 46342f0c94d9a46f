//! Voxelise: geometry-shader conservative rasterisation with an exact triangle/voxel test, into the lists of any grid.
//! Reads: triangles. Writes: list items, voxels (heads), voxel cells, counters. Twin: `tests/twins/voxelise.rs`.

use std::sync::Arc;

use super::Ground;
use super::constants::{EDGE, with};
use super::layout::GridPush;
use super::lists::Lists;
use crate::Result;
use crate::vk::{Bind, Context, DrawCall, Raster, RasterDesc, Recorder, RenderTarget, ZoneKind};

pub struct Voxelise {
    pipeline: Raster,
}

impl Voxelise {
    /// For grids of `edge` voxels a side. `dilated`: lists what the dilated triangles touch, as in the talk.
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)], edge: u32, dilated: bool) -> Result<Self> {
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
            constants: &with(constants.to_vec(), &[(EDGE, edge)]),
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
            let scale = 1.0 / lists.place.voxel;
            let push = GridPush { offset: lists.place.corner.map(|c| 0.0 - c * scale), scale };
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
