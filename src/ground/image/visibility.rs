//! A visibility buffer: the triangle and the depth that every sample of the image sees (Burns and Hunt, "The Visibility
//! Buffer: A Cache-Friendly Approach to Deferred Shading", JCGT 2013).

use std::sync::Arc;

use super::target::{DEPTH_BYTES, DEPTH_FORMAT, ImageShape};
use super::{BandFrame, ImagePassDesc, shader};
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::{Features, with};
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, ColorTarget, CompareOp, Context, DepthDesc, DepthTarget, Format, Image, ImageDesc, ImageUsageFlags, Load,
    Raster, RasterDesc, Recorder, Rect, RenderTarget,
};

/// Format of the visible triangle: 1 + 2 × its index + whether its back is visible; 0 without a triangle.
const FORMAT: Format = Format::R32_UINT;
/// Bytes of a sample: its triangle and its depth.
pub const SEEN_BYTES: u64 = 4 + DEPTH_BYTES;

/// Memory of one visibility buffer for each kind of surface.
pub fn plan(shape: &ImageShape) -> MemoryRow {
    ("visibility", shape.most_seen_samples() * SEEN_BYTES * shape.gathered_layers())
}

pub struct Visibility {
    seen: Image,
    depth: Image,
    pass: Raster,
}

/// The kind of surfaces whose nearest ones a visibility buffer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nearest {
    Opaque,
    /// Blended surfaces that no opaque surface hides.
    Blended,
}

impl Visibility {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, shape: &ImageShape, of: Nearest) -> Result<Self> {
        let (width, height, samples) = (shape.width, shape.most_seen_rows(), shape.samples);
        let fragment = match of {
            Nearest::Opaque => shader("ground/image/visibility.frag", &[("MASKED", desc.features.has(Features::MASK))]),
            Nearest::Blended => shader("ground/image/nearest_blended.frag", &[("MULTISAMPLED", samples > 1)]),
        };
        let blended = u32::from(of == Nearest::Blended);
        let pass = RasterDesc {
            label: "visibility",
            vertex: "ground/image/image.vert",
            fragment: Some(&fragment),
            constants: &with(desc.constants.clone(), &[("BLENDED", blended.into())]),
            color_formats: &[FORMAT],
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::GREATER, write: true }),
            samples,
            ..Default::default()
        };
        let image = |label, format, usage| {
            Image::new(context, &ImageDesc { label, format, width, height, samples, usage, ..Default::default() })
        };
        Ok(Self {
            seen: image("visibility", FORMAT, ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::SAMPLED)?,
            depth: image("depth", DEPTH_FORMAT, ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | ImageUsageFlags::SAMPLED)?,
            pass: Raster::new(context, &pass)?,
        })
    }

    /// Finds the visible triangles of a band. For blended surfaces, `opaque` holds the surfaces that hide them.
    pub fn record(&self, r: &mut Recorder, of: &BandFrame, opaque: Option<&Self>) {
        let (ground, mut call) = (of.ground(), of.ground().recorded());
        let mut binds = ground.image_binds();
        if let Some(opaque) = opaque {
            binds.push(Bind::image("opaque_depth", opaque.depth.view(), &ground.scene.texel_sampler));
            call = ground.recorded_blended();
        }
        let (view, load) = (self.seen.attachment_view(0), Load::Clear([0.0; 4]));
        let colors = [ColorTarget { view, resolve: None, load, store: true }];
        let binds = self.pass.select(&binds);
        let target = RenderTarget { colors: &colors, ..self.target(of, Load::Clear(0.0)) };
        target.draw_in_parts(r, |pass| pass.draw(&self.pass, &binds, &of.push(), call));
        r.full_barrier();
    }

    /// A render target with the rows that a band sees and their depth, without colours.
    pub fn target(&self, of: &BandFrame, load: Load<f32>) -> RenderTarget<'_> {
        let (shape, band) = (of.shape(), &of.band);
        RenderTarget {
            depth: Some(DepthTarget { view: self.depth.attachment_view(0), load, store: true }),
            width: shape.width,
            height: band.seen_rows,
            viewport: Some(Rect { x: 0, y: -(band.first_seen as i32), width: shape.width, height: shape.height }),
            ..Default::default()
        }
    }

    pub fn bind<'a>(&'a self, ground: &'a Ground) -> Bind<'a> {
        Bind::image("seen", self.seen.view(), &ground.scene.texel_sampler)
    }
}
