//! A volume of photons: what every voxel sends in sixteen directions, how much it stands in the way, and all mips.

use std::sync::Arc;

use crate::Result;
use crate::gi::CoarseLight;
use crate::ground::cell_passes::CellVolume;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::Settings;
use crate::vk::{
    Bind, Context, Filter, Format, Image, ImageDesc, ImageDim, ImageUsageFlags, Sampler, SamplerAddressMode,
};

pub const FORMAT: Format = Format::R16G16B16A16_SFLOAT;
/// Texels along an edge of the octahedral map.
pub const MAP_EDGE: u32 = 4;
/// Images of [`PhotonVolume`]: names to be sampled, to be filtered from and to be stored to, in shaders.
const SAMPLED: [&str; 3] = ["photons", "met_forth", "met_back"];
const BELOW: [&str; 3] = ["map_below", "forth_below", "back_below"];
const STORED: [&str; 3] = ["photon_map", "opacity_forth", "opacity_back"];

/// Of `edge`³ voxels; every level of the map is 4 × 4 blocks of the level's grid, one per direction.
pub struct PhotonVolume {
    /// Stored radiance times the area that faces the direction, and that area, over a voxel's face.
    pub map: Image,
    /// Opacity met by travellers along +x +y +z, and the share of samples.
    pub forth: Image,
    /// Opacity met by travellers along −x −y −z.
    pub back: Image,
    pub edge: u32,
    pub levels: u32,
    sampler: Sampler,
    /// 0 or 1.
    pub bounce: usize,
}

impl PhotonVolume {
    /// Of bounce 0 or 1.
    ///
    /// # Errors
    /// Too little memory, or a grid whose map is larger than the device's images.
    pub fn new(context: &Arc<Context>, bounce: usize, edge: u32) -> Result<Self> {
        let levels = edge.ilog2() + 1;
        let image = |name: &str, across: u32| {
            let usage = ImageUsageFlags::SAMPLED
                | ImageUsageFlags::STORAGE
                | ImageUsageFlags::TRANSFER_SRC
                | ImageUsageFlags::TRANSFER_DST;
            let label = format!("{} {name}", ["first bounce's", "second bounce's"][bounce]);
            let desc = ImageDesc {
                label: &label,
                dim: ImageDim::D3,
                format: FORMAT,
                width: across * edge,
                height: across * edge,
                depth_or_layers: edge,
                mips: levels,
                usage,
                ..Default::default()
            };
            Image::new(context, &desc)
        };
        Ok(Self {
            map: image("photons", MAP_EDGE)?,
            forth: image("opacity forth", 1)?,
            back: image("opacity back", 1)?,
            edge,
            levels,
            // There is nothing outside of the grid.
            sampler: Sampler::new(context, Filter::LINEAR, SamplerAddressMode::CLAMP_TO_BORDER)?,
            bounce,
        })
    }

    /// One for each bounce that is stored.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn per_bounce(context: &Arc<Context>, settings: &Settings) -> Result<Vec<Self>> {
        (0..settings.bounces.volumes() as usize).map(|bounce| Self::new(context, bounce, settings.voxels)).collect()
    }

    /// Bytes of [`Self::per_bounce`].
    pub fn plan(settings: &Settings) -> Vec<MemoryRow> {
        let texels: u64 = (0..=settings.voxels.ilog2()).map(|level| u64::from(settings.voxels >> level).pow(3)).sum();
        let bytes = 8 * (u64::from(MAP_EDGE).pow(2) + 2) * texels;
        let names = ["first bounce's photons", "second bounce's photons"];
        names[..settings.bounces.volumes() as usize].iter().map(|name| (*name, bytes)).collect()
    }

    /// To be looked up (`glsl/gi/photons/volume.glsl`).
    pub fn binds(&self) -> impl Iterator<Item = Bind<'_>> {
        SAMPLED.iter().zip(self.images()).map(|(name, image)| Bind::image(name, image.view(), &self.sampler))
    }

    /// All light that it holds, coarsely: the map's level of 8³ voxels.
    pub fn coarse(&self) -> CoarseLight<'_> {
        CoarseLight::Image(&self.map, self.levels - 4)
    }
}

impl CellVolume for PhotonVolume {
    fn edge(&self) -> u32 {
        self.edge
    }

    fn bounce(&self) -> usize {
        self.bounce
    }

    /// The map, opacity forth and back.
    fn images(&self) -> Vec<&Image> {
        vec![&self.map, &self.forth, &self.back]
    }

    /// For `glsl/gi/photons/mips.comp`.
    fn sources(&self, level: u32) -> Vec<Bind<'_>> {
        let images = BELOW.iter().zip(self.images());
        images.map(|(name, image)| Bind::image(name, image.mip_view(level - 1), &self.sampler)).collect()
    }

    /// For `glsl/gi/photons/store.glsl`.
    fn targets(&self, level: u32) -> Vec<Bind<'_>> {
        let images = STORED.iter().zip(self.images());
        images.map(|(name, image)| Bind::storage_image(name, image.mip_view(level))).collect()
    }
}
