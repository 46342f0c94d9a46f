//! A volume of seven faces, which holds what is seen along a ray that travels along +x +y +z −x −y −z, and on average, with
//! all mips.

use std::sync::Arc;

use super::cell_passes::CellVolume;
use super::memory_plan::MemoryRow;
use super::wants::CoarseLight;
use crate::Result;
use crate::settings::Settings;
use crate::vk::{
    Bind, ColorTarget, Context, Filter, Format, Image, ImageDesc, ImageDim, ImageUsageFlags, Load, Sampler,
    SamplerAddressMode,
};

pub const FACE_FORMAT: Format = Format::R16G16B16A16_SFLOAT;
/// +x +y +z −x −y −z, isotropic.
pub const FACES: usize = 7;

/// Seven 3D images with full mip chains.
pub struct FaceVolume {
    pub faces: [Image; FACES],
    pub edge: u32,
    pub levels: u32,
    sampler: Sampler,
    /// 0 or 1.
    bounce: usize,
}

impl FaceVolume {
    /// Of bounce 0 or 1, of `edge`³ voxels. `outside`: what a look-up finds there.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, bounce: usize, edge: u32, outside: SamplerAddressMode) -> Result<Self> {
        let name = ["first bounce", "second bounce"][bounce];
        let levels = edge.ilog2() + 1;
        let face = |suffix: &str| {
            Image::new(
                context,
                &ImageDesc {
                    label: &format!("{name} {suffix}"),
                    dim: ImageDim::D3,
                    format: FACE_FORMAT,
                    width: edge,
                    height: edge,
                    depth_or_layers: edge,
                    mips: levels,
                    samples: 1,
                    usage: ImageUsageFlags::COLOR_ATTACHMENT
                        | ImageUsageFlags::SAMPLED
                        | ImageUsageFlags::STORAGE
                        | ImageUsageFlags::TRANSFER_SRC
                        | ImageUsageFlags::TRANSFER_DST,
                    ..Default::default()
                },
            )
        };
        let suffixes = ["+x", "+y", "+z", "-x", "-y", "-z", "isotropic"];
        let faces: Vec<Image> = suffixes.into_iter().map(face).collect::<Result<_>>()?;
        let faces = faces.try_into().unwrap_or_else(|_| unreachable!("seven suffixes make seven faces"));
        Ok(Self { faces, edge, levels, sampler: Sampler::new(context, Filter::LINEAR, outside)?, bounce })
    }

    /// One for each bounce that is stored. `outside`: what a look-up finds there.
    ///
    /// # Errors
    /// Too little memory.
    pub fn per_bounce(context: &Arc<Context>, settings: &Settings, outside: SamplerAddressMode) -> Result<Vec<Self>> {
        let count = settings.bounces.volumes() as usize;
        (0..count).map(|bounce| Self::new(context, bounce, settings.voxels, outside)).collect()
    }

    /// Bytes of a volume of `edge`³ with all its mips.
    pub fn bytes(edge: u32) -> u64 {
        let texels: u64 = (0..=edge.ilog2()).map(|level| u64::from(edge >> level).pow(3)).sum();
        FACES as u64 * 8 * texels
    }

    /// Bytes of [`FaceVolume::per_bounce`].
    pub fn plan(settings: &Settings) -> Vec<MemoryRow> {
        let names = ["first bounce's volume", "second bounce's volume"];
        let count = settings.bounces.volumes() as usize;
        names[..count].iter().map(|name| (*name, Self::bytes(settings.voxels))).collect()
    }

    /// To be looked up (`glsl/ground/faces/look_up.glsl`).
    pub fn binds(&self) -> impl Iterator<Item = Bind<'_>> {
        const NAMES: [&str; FACES] =
            ["volume_0", "volume_1", "volume_2", "volume_3", "volume_4", "volume_5", "volume_6"];
        NAMES.iter().zip(&self.faces).map(|(name, face)| Bind::image(name, face.view(), &self.sampler))
    }

    /// A level as layered colour targets; every texel is written.
    pub fn colors(&self, level: u32) -> [ColorTarget<'_>; FACES] {
        std::array::from_fn(|face| ColorTarget {
            view: self.faces[face].attachment_view(level),
            resolve: None,
            load: Load::DontCare,
            store: true,
        })
    }

    /// All light that it holds, coarsely: the isotropic face's level of 8³ texels.
    pub fn coarse(&self) -> CoarseLight<'_> {
        CoarseLight::Image(&self.faces[FACES - 1], self.levels - 4)
    }
}

impl CellVolume for FaceVolume {
    fn edge(&self) -> u32 {
        self.edge
    }

    fn bounce(&self) -> usize {
        self.bounce
    }

    fn images(&self) -> Vec<&Image> {
        self.faces.iter().collect()
    }

    /// For `glsl/ground/faces/mips.glsl`.
    fn sources(&self, level: u32) -> Vec<Bind<'_>> {
        const NAMES: [&str; FACES] =
            ["source_0", "source_1", "source_2", "source_3", "source_4", "source_5", "source_6"];
        let faces = NAMES.iter().zip(&self.faces);
        faces.map(|(name, face)| Bind::image(name, face.mip_view(level - 1), &self.sampler)).collect()
    }

    /// For `glsl/ground/faces/store.glsl`.
    fn targets(&self, level: u32) -> Vec<Bind<'_>> {
        const NAMES: [&str; FACES] = ["faces_0", "faces_1", "faces_2", "faces_3", "faces_4", "faces_5", "faces_6"];
        NAMES.iter().zip(&self.faces).map(|(name, face)| Bind::storage_image(name, face.mip_view(level))).collect()
    }
}
