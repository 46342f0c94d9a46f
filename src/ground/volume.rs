//! Volumes of light: several RGBA16F images with all mips over one grid of voxels. Methods differ in the content of the
//! images.

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
    /// The end of the image's label.
    pub label: &'static str,
    /// Texels per voxel along x and along y.
    pub across: u32,
    /// Names in shaders: for look-ups, for reading the finer level in mips, and for storing.
    pub looked_up: &'static str,
    pub below: &'static str,
    pub stored: &'static str,
}

/// The description of a kind of volume.
#[derive(Clone, Copy)]
pub struct VolumeKind {
    /// The beginnings of the labels of the first and the second bounce's images, which are also their names in the
    /// memory plan.
    pub labels: [&'static str; 2],
    pub rows: [&'static str; 2],
    pub parts: &'static [VolumeImage],
    /// The index of the image that represents all light coarsely.
    pub coarse: usize,
    /// Whether levels are also colour targets, with a layer per slice.
    pub drawn: bool,
    /// The address mode of look-ups outside the grid.
    pub outside: SamplerAddressMode,
}

/// The number of images of a face volume.
pub const FACES: usize = 7;

/// Seven images: the light along rays that travel in +x +y +z −x −y −z, and its average (`glsl/ground/faces/`).
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
    /// The images, in the order of the kind's parts.
    pub images: Vec<Image>,
    /// Voxels along the edge of the finest level.
    pub edge: u32,
    pub levels: u32,
    /// The bounce, 0 or 1.
    pub bounce: usize,
    sampler: Sampler,
}

impl LightVolume {
    /// A volume of bounce 0 or 1, with `edge`³ voxels.
    ///
    /// # Errors
    /// There is too little memory, or the grid needs images beyond the device's limits.
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

    /// A volume for each stored bounce.
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

    /// Bindings for look-ups.
    pub fn binds(&self) -> impl Iterator<Item = Bind<'_>> {
        self.parts().map(|(part, image)| Bind::image(part.looked_up, image.view(), &self.sampler))
    }

    /// Bindings of the level below `level`, which the mips read.
    pub fn sources(&self, level: u32) -> Vec<Bind<'_>> {
        self.parts().map(|(part, image)| Bind::image(part.below, image.mip_view(level - 1), &self.sampler)).collect()
    }

    /// Bindings of a level for storing.
    pub fn targets(&self, level: u32) -> Vec<Bind<'_>> {
        self.parts().map(|(part, image)| Bind::storage_image(part.stored, image.mip_view(level))).collect()
    }

    /// Draws a triangle over the screen for every slice of a level, which writes every texel.
    pub fn draw<'a>(&'a self, r: &mut Recorder, pipeline: &Raster, binds: &[Bind<'_>], level: u32) {
        let color = |image: &'a Image| ColorTarget::overwritten(image.attachment_view(level));
        let (colors, edge): (Vec<_>, _) = (self.images.iter().map(color).collect(), self.edge >> level);
        let target = RenderTarget { colors: &colors, width: edge, height: edge, layers: edge, ..Default::default() };
        r.raster(&target, |pass| pass.draw(pipeline, binds, &(), DrawCall::Direct { vertices: 3, instances: edge }));
    }

    /// Bytes of those levels of all images.
    pub fn bytes(&self, levels: Range<u32>) -> u64 {
        let texels: u64 = self.kind.parts.iter().map(|part| u64::from(part.across).pow(2)).sum();
        8 * texels * levels.map(|level| u64::from(self.edge >> level).pow(3)).sum::<u64>()
    }

    /// The name of the pass that makes the mips.
    pub fn mips_zone(&self) -> &'static str {
        ["mips 1", "mips 2"][self.bounce]
    }

    /// A coarse representation of all light: a level of 8³ voxels.
    pub fn coarse(&self) -> CoarseLight<'_> {
        CoarseLight::Image(&self.images[self.kind.coarse], self.levels - 4)
    }
}
