//! Volumes of light, each of several RGBA32F images: two bands of spherical harmonics take four
//! (`glsl/gi/lpv/field.glsl`), beams take two, and the sums of beams six (`glsl/gi/lpv/beams.glsl`).

use std::sync::Arc;

use crate::Result;
use crate::vk::{
    Bind, Context, Filter, Format, Image, ImageDesc, ImageDim, ImageUsageFlags, Sampler, SamplerAddressMode,
};

pub struct Field {
    pub parts: Vec<Image>,
    sampler: Sampler,
}

/// Size and name of a [`Field`].
#[derive(Clone, Copy)]
pub struct FieldDesc<'a> {
    pub label: &'a str,
    pub parts: usize,
    /// Cells along each side.
    pub edge: u32,
    /// The number of grids, stacked along z.
    pub grids: u32,
}

impl FieldDesc<'_> {
    pub fn bytes(&self) -> u64 {
        self.parts as u64 * 16 * u64::from(self.edge).pow(3) * u64::from(self.grids)
    }
}

impl Field {
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, desc: &FieldDesc) -> Result<Self> {
        let part = |index: usize| {
            let desc = ImageDesc {
                label: &format!("{} {index}", desc.label),
                dim: ImageDim::D3,
                format: Format::R32G32B32A32_SFLOAT,
                width: desc.edge,
                height: desc.edge,
                depth_or_layers: desc.edge * desc.grids,
                usage: ImageUsageFlags::SAMPLED | ImageUsageFlags::STORAGE | ImageUsageFlags::TRANSFER_SRC,
                ..Default::default()
            };
            Image::new(context, &desc)
        };
        let parts = (0..desc.parts).map(part).collect::<Result<_>>()?;
        // Cells are fetched and not filtered.
        Ok(Self { parts, sampler: Sampler::new(context, Filter::NEAREST, SamplerAddressMode::CLAMP_TO_EDGE)? })
    }

    /// A binding for reading cells, as an array of that name and length. Entries beyond the field's images repeat its
    /// last one.
    pub fn read<'a>(&'a self, name: &'a str, length: usize) -> Bind<'a> {
        let last = self.parts.len() - 1;
        Bind::images(name, (0..length).map(|part| self.parts[part.min(last)].view()), &self.sampler)
    }

    /// A binding for loading and storing, as an array of that name.
    pub fn stored<'a>(&'a self, name: &'a str) -> Bind<'a> {
        Bind::storage_images(name, self.parts.iter().map(|part| part.mip_view(0)))
    }
}
