//! Blended surfaces: a list of fragments per pixel, as the talk has a list of triangles per voxel, shaded as opaque ones are. The
//! pass resolve sorts each list and composites it.
//! Reads: blended triangles, depth, materials, the method's light. Writes: lists, and what each fragment shows.

use std::sync::Arc;

use super::fragments::{FragmentShading, PIXEL_BYTES, empty, list_bytes, shaded_bytes};
use super::target::{DEPTH_FORMAT, ImageShape};
use super::visibility::Visibility;
use super::{BandFrame, ImagePassDesc};
use crate::Result;
use crate::ground::constants::with;
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, Buffer, BufferKind, CompareOp, ComputeDesc, Context, DepthDesc, DrawCall, Load, Raster, RasterDesc, Recorder,
    Sampler,
};

/// Where the next entry of the list is, and the depth of this one.
const LINK_BYTES: u64 = 8;

/// Bytes of [`Blended::new`].
pub fn plan(shape: &ImageShape, capacity: u32) -> MemoryRow {
    let capacity = u64::from(capacity);
    let pixels = u64::from(shape.width) * u64::from(shape.most_seen_rows());
    let lists = list_bytes(capacity) + LINK_BYTES * capacity + PIXEL_BYTES * pixels;
    ("blended fragments", lists + shaded_bytes(shape, capacity))
}

pub struct Blended {
    list: Buffer,
    links: Buffer,
    heads: Buffer,
    lister: Raster,
    shading: FragmentShading,
}

impl Blended {
    /// With room for `capacity` fragments. `shader`: shades one.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(
        context: &Arc<Context>,
        desc: &ImagePassDesc,
        shape: &ImageShape,
        capacity: u32,
        shader: &str,
    ) -> Result<Self> {
        let pixels = u64::from(shape.width) * u64::from(shape.most_seen_rows());
        let per_sample = if context.post_depth_coverage || shape.samples == 1 { "" } else { " PER_SAMPLE" };
        let lister = RasterDesc {
            label: "blended",
            vertex: "ground/image/image.vert",
            fragment: Some(&format!("ground/image/blended.frag{per_sample}")),
            constants: &with(desc.constants.clone(), &[("BLENDED", 1u32.into())]),
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::GREATER_OR_EQUAL, write: false }),
            samples: shape.samples,
            ..Default::default()
        };
        let pass = ComputeDesc { label: "image blended", shader, constants: &desc.constants };
        let (list, links) = lists(context, capacity)?;
        Ok(Self {
            list,
            links,
            heads: Buffer::new(context, "blended heads", PIXEL_BYTES * pixels, BufferKind::Device)?,
            lister: Raster::new(context, &lister)?,
            shading: FragmentShading::new(context, &pass, "blended fragments", shape.outputs, u64::from(capacity))?,
        })
    }

    /// Makes room for `capacity` fragments.
    ///
    /// # Errors
    /// Too little memory.
    pub fn grow(&mut self, context: &Arc<Context>, capacity: u32) -> Result<()> {
        (self.list, self.links) = lists(context, capacity)?;
        self.shading.grow(context, u64::from(capacity))
    }

    /// Lists and shades what is seen of the blended triangles. `visibility`: what opaque surfaces hide. `binds`: of the shader.
    pub fn record(&self, r: &mut Recorder, of: &BandFrame, visibility: &Visibility, binds: &[Bind<'_>]) {
        let ground = of.ground;
        empty(r, &self.list);
        r.fill(&self.heads, 0, self.heads.bytes(), 0);
        r.full_barrier();
        let mut all = ground.image_binds();
        all.extend(self.binds());
        let all = self.lister.select(&all);
        let call = DrawCall::Direct { vertices: 3 * ground.desc.counts.blended, instances: 1 };
        r.raster(&visibility.target(of, Load::Load), |pass| pass.draw(&self.lister, &all, &of.rows.push(), call));
        r.full_barrier();
        self.shading.record(r, of, &self.list, binds);
    }

    fn binds(&self) -> [Bind<'_>; 3] {
        let (list, links) = (Bind::buffer("blended_count", &self.list), Bind::buffer("blended_links", &self.links));
        [list, links, Bind::buffer("blended_heads", &self.heads)]
    }

    /// What the pass resolve reads.
    pub fn resolve_binds<'a>(&'a self, texels: &'a Sampler) -> impl Iterator<Item = Bind<'a>> {
        self.binds().into_iter().chain([Bind::images("shaded_blended", self.shading.shaded(), texels)])
    }
}

fn lists(context: &Arc<Context>, capacity: u32) -> Result<(Buffer, Buffer)> {
    let buffer = |label: &str, bytes| Buffer::new(context, label, bytes, BufferKind::Device);
    let capacity = u64::from(capacity);
    Ok((buffer("blended list", list_bytes(capacity))?, buffer("blended links", LINK_BYTES * capacity)?))
}
