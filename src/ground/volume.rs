//! Volumes of light, RGBA16F with all mips: a few images over one grid of voxels. Methods differ in what the images
//! hold.

use std::ops::Range;
use std::sync::Arc;

use super::memory_plan::MemoryRow;
use super::wants::CoarseLight;
use crate::Result;
use crate::settings::Settings;
use crate::vk::{
    Bind, ColorTarget, Context, DrawCall, Filter, Format, Image, ImageDesc, ImageDim, ImageUsageFlags, Raster,
    Recorder, RenderTarget, Sampler, SamplerAddressMode,
};

pub const FORMAT: Format = Format::R16G16B16A16_SFLOAT;

/// An image of a volume.
pub struct VolumeImage {
    /// The end of its label.
    pub label: &'static str,
    /// Texels of a voxel along x, and along y.
    pub across: u32,
    /// Names in shaders: to be looked up, to be filtered from and to be stored to.
    pub looked_up: &'static str,
    pub below: &'static str,
    pub stored: &'static str,
}

/// A description of volumes.
#[derive(Clone, Copy)]
pub struct VolumeKind {
    /// The beginnings of the labels of the first and the second bounce's images, and the names of these volumes in the
    /// memory plan.
    pub labels: [&'static str; 2],
    pub rows: [&'static str; 2],
    pub parts: &'static [VolumeImage],
    /// The part that shows, coarsely, all light.
    pub coarse: usize,
    /// Whether levels are colour targets too, a layer per slice.
    pub drawn: bool,
    /// The rule by which a look-up reads outside of the grid.
    pub outside: SamplerAddressMode,
}

/// Images of a face each.
pub const FACES: usize = 7;

/// Seven images: the light that is seen along rays that travel along +x +y +z −x −y −z, and on average
/// (`glsl/ground/faces/`).
pub const FACE_VOLUME: VolumeKind = VolumeKind {
    labels: ["first bounce", "second bounce"],
    rows: ["first bounce's volume", "second bounce's volume"],
    parts: &[
        VolumeImage { label: "+x", across: 1, looked_up: "volume_0", below: "source_0", stored: "faces_0" },
        VolumeImage { label: "+y", across: 1, looked_up: "volume_1", below: "source_1", stored: "faces_1" },
        VolumeImage { label: "+z", across: 1, looked_up: "volume_2", below: "source_2", stored: "faces_2" },
        VolumeImage { label: "-x", across: 1, looked_up: "volume_3", below: "source_3", stored: "faces_3" },
        VolumeImage { label: "-y", across: 1, looked_up: "volume_4", below: "source_4", stored: "faces_4" },
        VolumeImage { label: "-z", across: 1, looked_up: "volume_5", below: "source_5", stored: "faces_5" },
        VolumeImage { label: "isotropic", across: 1, looked_up: "volume_6", below: "source_6", stored: "faces_6" },
    ],
    coarse: FACES - 1,
    drawn: true,
    outside: SamplerAddressMode::CLAMP_TO_EDGE,
};

pub struct LightVolume {
    kind: VolumeKind,
    /// One per part.
    pub images: Vec<Image>,
    /// Voxels of the finest level.
    pub edge: u32,
    pub levels: u32,
    /// 0 or 1.
    pub bounce: usize,
    sampler: Sampler,
}

impl LightVolume {
    /// Of bounce 0 or 1, of `edge`³ voxels.
    ///
    /// # Errors
    /// Too little memory, or a grid with images larger than the device's may be.
    pub fn new(context: &Arc<Context>, kind: VolumeKind, bounce: usize, edge: u32) -> Result<Self> {
        let levels = edge.ilog2() + 1;
        let copied = ImageUsageFlags::TRANSFER_SRC | ImageUsageFlags::TRANSFER_DST;
        let mut usage = copied | ImageUsageFlags::SAMPLED | ImageUsageFlags::STORAGE;
        if kind.drawn {
            usage |= ImageUsageFlags::COLOR_ATTACHMENT;
        }
        let image = |part: &VolumeImage| {
            let desc = ImageDesc {
                label: &format!("{} {}", kind.labels[bounce], part.label),
                dim: ImageDim::D3,
                format: FORMAT,
                width: part.across * edge,
                height: part.across * edge,
                depth_or_layers: edge,
                mips: levels,
                usage,
                ..Default::default()
            };
            Image::new(context, &desc)
        };
        let images = kind.parts.iter().map(image).collect::<Result<_>>()?;
        Ok(Self { kind, images, edge, levels, bounce, sampler: Sampler::new(context, Filter::LINEAR, kind.outside)? })
    }

    /// One for each bounce that is stored.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn per_bounce(context: &Arc<Context>, kind: VolumeKind, settings: &Settings) -> Result<Vec<Self>> {
        let bounces = 0..settings.bounces.stored() as usize;
        bounces.map(|bounce| Self::new(context, kind, bounce, settings.voxels)).collect()
    }

    /// Bytes of [`Self::per_bounce`].
    pub fn plan(kind: &VolumeKind, settings: &Settings) -> Vec<MemoryRow> {
        let voxels: u64 = (0..=settings.voxels.ilog2()).map(|level| u64::from(settings.voxels >> level).pow(3)).sum();
        let bytes = kind.parts.iter().map(|part| 8 * u64::from(part.across).pow(2) * voxels).sum();
        kind.rows[..settings.bounces.stored() as usize].iter().map(|row| (*row, bytes)).collect()
    }

    fn parts(&self) -> impl Iterator<Item = (&'static VolumeImage, &Image)> {
        self.kind.parts.iter().zip(&self.images)
    }

    /// To be looked up.
    pub fn binds(&self) -> impl Iterator<Item = Bind<'_>> {
        self.parts().map(|(part, image)| Bind::image(part.looked_up, image.view(), &self.sampler))
    }

    /// The level below `level`, to be read by the mips.
    pub fn sources(&self, level: u32) -> Vec<Bind<'_>> {
        self.parts().map(|(part, image)| Bind::image(part.below, image.mip_view(level - 1), &self.sampler)).collect()
    }

    /// A level, to be stored to.
    pub fn targets(&self, level: u32) -> Vec<Bind<'_>> {
        self.parts().map(|(part, image)| Bind::storage_image(part.stored, image.mip_view(level))).collect()
    }

    /// Draws a triangle over the screen for every slice of a level; every texel is written.
    pub fn draw<'a>(&'a self, r: &mut Recorder, pipeline: &Raster, binds: &[Bind<'_>], level: u32) {
        let color = |image: &'a Image| ColorTarget::overwritten(image.attachment_view(level));
        let (colors, edge): (Vec<_>, _) = (self.images.iter().map(color).collect(), self.edge >> level);
        let target = RenderTarget { colors: &colors, width: edge, height: edge, layers: edge, ..Default::default() };
        r.raster(&target, |pass| pass.draw(pipeline, binds, &(), DrawCall::Direct { vertices: 3, instances: edge }));
    }

    /// The bytes of those levels of its images.
    pub fn bytes(&self, levels: Range<u32>) -> u64 {
        let texels: u64 = self.kind.parts.iter().map(|part| u64::from(part.across).pow(2)).sum();
        8 * texels * levels.map(|level| u64::from(self.edge >> level).pow(3)).sum::<u64>()
    }

    /// The name of the pass that makes its mips.
    pub fn mips_zone(&self) -> &'static str {
        ["mips 1", "mips 2"][self.bounce]
    }

    /// All light that it holds, coarsely: a level of 8³ voxels.
    pub fn coarse(&self) -> CoarseLight<'_> {
        CoarseLight::Image(&self.images[self.kind.coarse], self.levels - 4)
    }
}
