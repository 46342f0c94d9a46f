//! Voxelise: adds every triangle to the list of every voxel that it touches, in each grid, by an exact triangle/voxel
//! test. Reads: triangles. Writes: list items, voxels (heads), voxel cells, counters. Twin: `tests/twins/voxelise.rs`.
//!
//! A compute pass visits the columns of voxels around each triangle. As in the talk, a conservative raster can do this
//! instead, with a pixel per column: a geometry shader dilates triangles, or the hardware rasterises conservatively.
//!
//! The other way is by samples: a multisampled raster without attachments or geometry shader, whose vertex shader
//! fetches the whole triangle (`glsl/ground/voxelise_samples.vert`). A voxel lists a triangle if samples of it are in
//! the voxel, with their number. This also writes item samples. Twin: `tests/twins/cover.rs`.

use std::sync::Arc;

use super::boxes::FACTOR;
use super::constants::with;
use super::grid::GridPlace;
use super::layout::GridPush;
use super::lists::Lists;
use super::wants::Wants;
use super::{Ground, over_threads};
use crate::settings::Conservative;
use crate::vk::{
    Bind, Compute, ComputeDesc, Constant, Context, DrawCall, Raster, RasterDesc, Recorder, RenderTarget,
    SampleCountFlags, ZoneKind,
};
use crate::{Error, Result};

pub enum Voxelise {
    Compute(Compute),
    /// A raster without attachments, with this number of samples per pixel.
    Drawn {
        pipeline: Raster,
        samples: u32,
    },
}

/// Threads of a workgroup in `glsl/ground/voxelise.comp`. Each thread lists a triangle, or all threads share a triangle
/// with many columns.
const GROUP: u32 = 64;
/// The minimum number of workgroups over all triangles, so that every processor has a part of the large ones.
const LEAST_GROUPS: u32 = 2048;
/// The maximum number of workgroups that share a triangle.
const MOST_SHARES: u32 = 8;

/// The number of samples per pixel, at most `wanted`, of a raster without attachments with Vulkan's standard sample
/// locations.
///
/// # Errors
/// Several samples are needed, and the device has no standard locations.
pub fn samples_per_pixel(context: &Context, wanted: u32) -> Result<u32> {
    let limits = &context.limits;
    if wanted > 1 && limits.standard_sample_locations == 0 {
        return Err(Error::Device(format!(
            "{} does not say where the samples of a pixel lie: set photons.samples to 1, or choose another device",
            context.name
        )));
    }
    let offered =
        |count: &u32| limits.framebuffer_no_attachments_sample_counts.contains(SampleCountFlags::from_raw(*count));
    Ok([8, 4].into_iter().filter(|count| *count <= wanted).find(offered).unwrap_or(1))
}

impl Voxelise {
    /// Lists the triangles that touch voxels or, as in the talk, whose dilated form does.
    ///
    /// # Errors
    /// The device lacks a feature that `wants` needs, or dilated triangles are requested from a pass that does not
    /// dilate.
    pub fn new(context: &Arc<Context>, constants: &[Constant], wants: &Wants) -> Result<Self> {
        let Wants { conservative, dilated, .. } = *wants;
        if conservative != Conservative::GeometryShader && dilated {
            return Err(Error::Usage(format!(
                "grid.conservative = {conservative} lists what triangles touch, but the method asks for what dilated ones touch: set \
                 grid.conservative to geometry-shader",
            )));
        }
        if conservative == Conservative::Compute {
            let desc = ComputeDesc { label: "voxelise", shader: "ground/voxelise.comp", constants };
            return Ok(Self::Compute(Compute::new(context, &desc)?));
        }
        let hardware = conservative == Conservative::Hardware;
        if hardware && !context.conservative_rasterization {
            return Err(Error::Device(format!(
                "grid.conservative = hardware needs VK_EXT_conservative_rasterization, which {} does not offer: set \
                 grid.conservative to compute, or choose another device",
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
            constants: &with(constants.to_vec(), &[("HARDWARE", u32::from(hardware).into())]),
            conservative: hardware,
            ..Default::default()
        };
        Self::made_of(context, &desc)
    }

    /// Lists triangles whose samples are in a voxel. `wanted` is the number of samples per pixel, as far as the device
    /// supports it.
    ///
    /// # Errors
    /// As [`samples_per_pixel`].
    pub fn by_samples(context: &Arc<Context>, constants: &[Constant], wanted: u32) -> Result<Self> {
        let samples = samples_per_pixel(context, wanted)?;
        let desc = RasterDesc {
            label: "voxelise",
            vertex: "ground/voxelise_samples.vert",
            fragment: Some("ground/voxelise_samples.frag"),
            constants: &with(constants.to_vec(), &[("SAMPLES", samples.into())]),
            samples,
            ..Default::default()
        };
        Self::made_of(context, &desc)
    }

    /// A raster without attachments over every column of voxels.
    ///
    /// # Errors
    /// The device is lost.
    pub fn made_of(context: &Arc<Context>, desc: &RasterDesc) -> Result<Self> {
        Ok(Self::Drawn { pipeline: Raster::new(context, desc)?, samples: desc.samples })
    }

    /// `zone` is the name of the pass.
    pub fn record(&self, recorder: &mut Recorder, zone: &'static str, ground: &Ground, lists: &Lists) {
        let kind = if matches!(self, Self::Compute(_)) { ZoneKind::Compute } else { ZoneKind::Raster };
        recorder.zone(zone, kind, lists.items.bytes(), |r| {
            r.full_barrier(); // record wrote the triangles and the draw's count, and reset the lists
            self.list(r, ground, lists);
        });
    }

    /// Lists all recorded triangles in a grid.
    pub fn list(&self, recorder: &mut Recorder, ground: &Ground, lists: &Lists) {
        let binds = [
            Bind::buffer("globals", &lists.globals),
            Bind::buffer("recorded", &ground.base().globals),
            Bind::buffer("triangles", &ground.triangles),
            Bind::buffer("list_items", &lists.items),
            Bind::buffer("heads", &lists.heads),
            Bind::buffer("cells", &lists.cells.cells),
            Bind::buffer("item_samples", &lists.item_samples),
        ];
        let pushes = pushes(lists, ground.desc.grid.boxes);
        match self {
            Self::Compute(pipeline) => {
                let [x, y, _] = over_threads(ground.desc.counts.triangles, GROUP);
                let shares = LEAST_GROUPS.div_ceil(x * y).min(MOST_SHARES);
                let binds = pipeline.select(&binds);
                pushes.iter().for_each(|push| recorder.dispatch(pipeline, &binds, push, [x, y, shares]));
            }
            Self::Drawn { pipeline, samples } => {
                let edge = lists.place.edge;
                let target = RenderTarget { width: edge, height: edge, samples: *samples, ..Default::default() };
                let binds = pipeline.select(&binds);
                recorder.raster(&target, |pass| {
                    pushes.iter().for_each(|push| pass.draw(pipeline, &binds, push, ground.recorded()));
                });
            }
        }
    }
}

/// Push constants for the grid, and for each box of finer voxels within the base grid.
fn pushes(lists: &Lists, boxes: u32) -> Vec<GridPush> {
    let edge = lists.place.edge;
    if lists.place != GridPlace::base(edge) || boxes == 0 {
        let [x, y, z, scale] = lists.place.from_base();
        return vec![GridPush { offset: [x, y, z], scale, first: 0, hole: [0; 3], hole_edge: 0 }];
    }
    let scale = |number: u32| FACTOR.powi(number as i32) as f32;
    let corner = |number: u32| if number == 0 { [0.0; 3] } else { lists.boxes[number as usize - 1] };
    let push = |number: u32| {
        let (scale, begin) = (scale(number), corner(number));
        let inner = if number < boxes { corner(number + 1) } else { begin };
        let hole = std::array::from_fn(|axis| ((inner[axis] - begin[axis]) * scale) as i32);
        let hole_edge = if number < boxes { edge / FACTOR as u32 } else { 0 };
        let first = number * edge.pow(3);
        GridPush { offset: begin.map(|c| 0.0 - c * scale), scale, first, hole, hole_edge: hole_edge as i32 }
    };
    (0..=boxes).map(push).collect()
}

impl Ground {
    /// A draw of all recorded triangles.
    pub fn recorded(&self) -> DrawCall<'_> {
        DrawCall::Indirect { buffer: &self.base().globals, offset: 0 }
    }

    /// A draw of all blended triangles.
    pub fn recorded_blended(&self) -> DrawCall<'_> {
        DrawCall::Direct { vertices: 3 * self.desc.counts.blended, instances: 1 }
    }
}
