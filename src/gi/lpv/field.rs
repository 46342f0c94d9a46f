//! Volumes of light in two bands: the flux and its three moments, RGBA32F images. `glsl/gi/lpv/field.glsl` says what they hold.

use std::sync::Arc;

use crate::Result;
use crate::vk::{
    Bind, Context, Filter, Format, Image, ImageDesc, ImageDim, ImageUsageFlags, Sampler, SamplerAddressMode,
};

/// Flux, x, y, z.
const PARTS: usize = 4;

pub struct Field {
    pub parts: [Image; PARTS],
    sampler: Sampler,
}

impl Field {
    /// Of `grids` grids of `edge`³ cells, one above the other.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, label: &str, edge: u32, grids: u32) -> Result<Self> {
        let part = |suffix: &str| {
            let desc = ImageDesc {
                label: &format!("{label} {suffix}"),
                dim: ImageDim::D3,
                format: Format::R32G32B32A32_SFLOAT,
                width: edge,
                height: edge,
                depth_or_layers: edge * grids,
                usage: ImageUsageFlags::SAMPLED | ImageUsageFlags::STORAGE | ImageUsageFlags::TRANSFER_SRC,
                ..Default::default()
            };
            Image::new(context, &desc)
        };
        let parts = [part("flux")?, part("x")?, part("y")?, part("z")?];
        // Cells are fetched, nothing is filtered.
        Ok(Self { parts, sampler: Sampler::new(context, Filter::NEAREST, SamplerAddressMode::CLAMP_TO_EDGE)? })
    }

    /// Bytes of a field.
    pub fn bytes(edge: u32, grids: u32) -> u64 {
        PARTS as u64 * 16 * u64::from(edge).pow(3) * u64::from(grids)
    }

    /// To be read cell by cell, under these names.
    pub fn read<'a>(&'a self, names: [&'a str; PARTS]) -> [Bind<'a>; PARTS] {
        std::array::from_fn(|part| Bind::image(names[part], self.parts[part].view(), &self.sampler))
    }

    /// To be stored to, or loaded from and stored to.
    pub fn stored<'a>(&'a self, names: [&'a str; PARTS]) -> [Bind<'a>; PARTS] {
        std::array::from_fn(|part| Bind::storage_image(names[part], self.parts[part].mip_view(0)))
    }
}
