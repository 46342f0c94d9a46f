//! A visibility buffer: which triangle is seen, by every sample of the image or by every gathered pixel (Burns and Hunt, "The Visibility
//! Buffer: A Cache-Friendly Approach to Deferred Shading", JCGT 2013).

use std::sync::Arc;

use super::ImagePassDesc;
use super::target::DEPTH_FORMAT;
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::Features;
use crate::ground::layout::BandPush;
use crate::vk::{
    Bind, ColorTarget, CompareOp, Context, DepthDesc, Format, Image, ImageDesc, ImageUsageFlags, Load, Raster,
    RasterDesc, Recorder, RenderTarget,
};

/// Of what is seen: 1 + 2 × the triangle's place + whether its back is; 0 is nothing.
const FORMAT: Format = Format::R32_UINT;
/// Bytes of a sample.
pub const SEEN_BYTES: u64 = 4;

pub struct Visibility {
    seen: Image,
    pass: Raster,
}

/// The inputs of a [`Visibility`].
pub struct VisibilityDesc {
    /// Of the pixels that light is gathered at, and not of the image.
    pub gathered: bool,
    pub width: u32,
    pub height: u32,
    /// Per pixel.
    pub samples: u32,
}

impl Visibility {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, of: &VisibilityDesc) -> Result<Self> {
        let VisibilityDesc { gathered, width, height, samples } = *of;
        let (label, form) = if gathered { ("gathered visibility", " GATHERED") } else { ("visibility", "") };
        let masked = if desc.features.has(Features::MASK) { " MASKED" } else { "" };
        let pass = RasterDesc {
            label,
            vertex: "ground/image/image.vert",
            fragment: Some(&format!("ground/image/visibility.frag{masked}{form}")),
            constants: &desc.constants,
            color_formats: &[FORMAT],
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::GREATER, write: true }),
            samples,
            ..Default::default()
        };
        let usage = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::SAMPLED;
        let seen = ImageDesc { label, format: FORMAT, width, height, samples, usage, ..Default::default() };
        Ok(Self { seen: Image::new(context, &seen)?, pass: Raster::new(context, &pass)? })
    }

    /// Finds what is seen in rows from `first_row` on. `target`: with a depth, which is cleared.
    pub fn record(&self, r: &mut Recorder, ground: &Ground, target: &RenderTarget<'_>, first_row: u32) {
        let (view, load) = (self.seen.attachment_view(0), Load::Clear([0.0; 4]));
        let colors = [ColorTarget { view, resolve: None, load, store: true }];
        let binds = self.pass.select(&ground.image_binds());
        RenderTarget { colors: &colors, ..*target }.draw_in_parts(r, |pass| {
            pass.draw(&self.pass, &binds, &BandPush { first_row }, ground.recorded());
        });
        r.full_barrier();
    }

    pub fn bind<'a>(&'a self, ground: &'a Ground) -> Bind<'a> {
        Bind::image("seen", self.seen.view(), &ground.scene.texel_sampler)
    }
}
