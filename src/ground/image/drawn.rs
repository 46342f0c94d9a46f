//! Opaque surfaces that are shaded while they are drawn, triangle by triangle, as in the talk. Reads: triangles,
//! materials, the method's light. Writes: the shaded samples.

use std::sync::Arc;

use super::target::{COLOR_FORMAT, DEPTH_FORMAT, ImageShape};
use super::{BandFrame, ImagePassDesc, shader};
use crate::Result;
use crate::ground::Ground;
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, ColorTarget, CompareOp, Context, DepthDesc, Image, ImageDesc, ImageUsageFlags, Raster, RasterDesc, Recorder,
    RenderTarget,
};

pub struct Drawn {
    colors: Vec<Image>,
    pass: Raster,
}

/// Memory of [`Drawn::new`].
pub fn plan(shape: &ImageShape) -> MemoryRow {
    ("image, as drawn", shape.most_seen_samples() * shape.color_bytes())
}

impl Drawn {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, shape: &ImageShape) -> Result<Self> {
        let (width, height, samples) = (shape.width, shape.most_seen_rows(), shape.samples);
        let usage = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::SAMPLED;
        let image = |index: usize| {
            let (label, format) = (format!("image, as drawn {}", index + 1), COLOR_FORMAT);
            let desc = ImageDesc { label: &label, format, width, height, samples, usage, ..Default::default() };
            Image::new(context, &desc)
        };
        let gathered = ("GATHERED", shape.gathers.is_some());
        let forms = [gathered, ("AOVS", shape.outputs > 1), ("MULTISAMPLED", samples > 1)];
        let pass = RasterDesc {
            label: "image",
            vertex: "ground/image/image.vert",
            fragment: Some(&shader(&format!("gi/{}/image.frag", desc.method), &forms)),
            constants: &desc.constants,
            color_formats: &vec![COLOR_FORMAT; shape.outputs],
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::EQUAL, write: false }),
            samples,
            ..Default::default()
        };
        Ok(Self { colors: (0..shape.outputs).map(image).collect::<Result<_>>()?, pass: Raster::new(context, &pass)? })
    }

    /// Draws a band. `depth` is a target with the depth of visible surfaces. `binds` are those of the shader.
    pub fn record(&self, r: &mut Recorder, of: &BandFrame, depth: &RenderTarget<'_>, binds: &[Bind<'_>]) {
        let colors: Vec<_> =
            self.colors.iter().map(|image| ColorTarget::overwritten(image.attachment_view(0))).collect();
        let binds = self.pass.select(binds);
        let target = RenderTarget { colors: &colors, ..*depth };
        target.draw_in_parts(r, |pass| pass.draw(&self.pass, &binds, &of.push(), of.ground().recorded()));
        r.full_barrier();
    }

    /// The images, as a binding of the pass resolve.
    pub fn bind<'a>(&'a self, ground: &'a Ground) -> Bind<'a> {
        Bind::images("shaded", self.colors.iter().map(Image::view), &ground.scene.texel_sampler)
    }
}
