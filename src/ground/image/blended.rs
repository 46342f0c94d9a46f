//! Blended surfaces: a list of samples per pixel, analogous to the talk's list of triangles per voxel, becomes
//! fragments that are sorted and shaded like opaque ones. The pass resolve composites them. Reads: blended triangles,
//! depth, materials, the method's light. Writes: lists, and the shaded fragments.

use std::sync::Arc;

use super::fragments::{FragmentShading, GROUP, PIXEL_BYTES, empty, list_bytes, shaded_bytes};
use super::target::{DEPTH_FORMAT, ImageShape};
use super::visibility::{Nearest, Visibility};
use super::{BandFrame, ImagePassDesc};
use crate::Result;
use crate::ground::constants::with;
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, Buffer, BufferKind, CompareOp, Compute, ComputeDesc, Context, DepthDesc, Load, Raster, RasterDesc, Recorder,
    Rect, RenderTarget, Sampler,
};

/// Bytes of an entry of a sample list.
const SAMPLE_BYTES: u64 = 16;
const COUNT_BYTES: u64 = 4;
/// Bytes of a pixel: the head of its list, the start of its fragments, and their number.
const HEAD_BYTES: u64 = 3 * PIXEL_BYTES;

/// Memory of [`Blended::new`].
pub fn plan(shape: &ImageShape, capacity: u32) -> MemoryRow {
    let capacity = u64::from(capacity);
    let lists = COUNT_BYTES + SAMPLE_BYTES * capacity + list_bytes(capacity) + HEAD_BYTES * shape.most_seen_pixels();
    ("blended fragments", lists + shaded_bytes(shape, capacity))
}

pub struct Blended {
    samples: Buffer,
    heads: Buffer,
    list: Buffer,
    of_pixels: Buffer,
    lister: Raster,
    sorter: Compute,
    shading: FragmentShading,
}

impl Blended {
    /// A pass with room for `capacity` samples that see a blended triangle.
    ///
    /// # Errors
    /// There is too little memory, or the device is lost.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, shape: &ImageShape, capacity: u32) -> Result<Self> {
        let pixels = shape.most_seen_pixels();
        let lister = RasterDesc {
            label: "blended",
            vertex: "ground/image/image.vert",
            fragment: Some("ground/image/blended.frag"),
            constants: &with(desc.constants.clone(), &[("BLENDED", 1u32.into())]),
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::GREATER_OR_EQUAL, write: false }),
            samples: shape.samples,
            ..Default::default()
        };
        let sorter = ComputeDesc { label: "blended", shader: "ground/image/blended.comp", constants: &desc.constants };
        let buffer = |label: &str, bytes| Buffer::new(context, label, bytes, BufferKind::Device);
        let (samples, list) = lists(context, capacity)?;
        Ok(Self {
            samples,
            heads: buffer("blended heads", PIXEL_BYTES * pixels)?,
            list,
            of_pixels: buffer("blended fragments of pixels", 2 * PIXEL_BYTES * pixels)?,
            lister: Raster::new(context, &lister)?,
            sorter: Compute::new(context, &sorter)?,
            shading: FragmentShading::new(context, desc, shape, Nearest::Blended, u64::from(capacity))?,
        })
    }

    /// Grows the buffers for `capacity` samples.
    ///
    /// # Errors
    /// Too little memory.
    pub fn grow(&mut self, context: &Arc<Context>, capacity: u32) -> Result<()> {
        // The lists grow last, so that the shaded fragments always have room for all of their entries, even after an
        // error.
        let lists = lists(context, capacity)?;
        self.shading.grow(context, u64::from(capacity))?;
        (self.samples, self.list) = lists;
        Ok(())
    }

    /// Lists, sorts and shades the visible blended triangles. `visibility` holds the opaque surfaces, which hide
    /// blended ones. `binds` are those of the shader.
    pub fn record(&self, r: &mut Recorder, of: &BandFrame, visibility: &Visibility, binds: &[Bind<'_>]) {
        let ground = of.ground();
        empty(r, &self.list);
        r.fill(&self.samples, 0, COUNT_BYTES, 0);
        let row = u64::from(of.shape().width) * PIXEL_BYTES;
        r.fill(&self.heads, u64::from(of.rows.first) * row, u64::from(of.rows.count) * row, 0);
        r.full_barrier();
        let mut all = ground.image_binds();
        all.push(Bind::buffer("blended_sample_count", &self.samples));
        all.push(Bind::buffer("blended_heads", &self.heads));
        let lister = self.lister.select(&all);
        let area = Rect { x: 0, y: of.rows.first as i32, width: of.shape().width, height: of.rows.count };
        let target = RenderTarget { area: Some(area), ..visibility.target(of, Load::Load) };
        r.raster(&target, |pass| pass.draw(&self.lister, &lister, &of.push(), ground.recorded_blended()));
        r.full_barrier();
        all.push(Bind::buffer("fragment_counts", &self.list));
        all.push(Bind::buffer("blended_of_pixels", &self.of_pixels));
        let groups = [of.shape().width.div_ceil(GROUP), of.rows.count, 1];
        r.dispatch(&self.sorter, &self.sorter.select(&all), &of.rows.push(), groups);
        r.full_barrier();
        self.shading.record(r, of, &self.list, binds);
    }

    /// The shaded fragments, as bindings of the pass resolve.
    pub fn resolve_binds<'a>(&'a self, texels: &'a Sampler) -> [Bind<'a>; 3] {
        [
            Bind::buffer("blended_counts", &self.list),
            Bind::buffer("blended_of_pixels", &self.of_pixels),
            Bind::images("shaded_blended", self.shading.shaded(), texels),
        ]
    }
}

/// The buffers of the sample list and of the fragment list.
fn lists(context: &Arc<Context>, capacity: u32) -> Result<(Buffer, Buffer)> {
    let buffer = |label: &str, bytes| Buffer::new(context, label, bytes, BufferKind::Device);
    let capacity = u64::from(capacity);
    Ok((
        buffer("blended samples", COUNT_BYTES + SAMPLE_BYTES * capacity)?,
        buffer("blended list", list_bytes(capacity))?,
    ))
}
