//! The image on the device, its shape and its bands. Samples and fragments are kept for one band of rows, so that an
//! image of any size needs limited additional memory. The image stays on the device until a [`Readback`] copies it.

use std::sync::Arc;

use super::fragments::{self, FRAGMENT_BYTES, MOST_AT_ONCE};
use super::gather::{GatherShape, RowRange};
use super::visibility::{self, SEEN_BYTES};
use super::{blended, drawn};
use crate::Result;
use crate::ground::memory_plan::MemoryRow;
use crate::ground::wants::Wants;
use crate::layers::{Aov, Layers};
use crate::settings::ImageSettings;
use crate::vk::{Bind, Buffer, BufferKind, Context, Format, Image, ImageDesc, ImageRegion, ImageUsageFlags, Recorder};

pub const COLOR_FORMAT: Format = Format::R32G32B32A32_SFLOAT;
pub const DEPTH_FORMAT: Format = Format::D32_SFLOAT;
const COLOR_BYTES: u64 = 16;
pub const DEPTH_BYTES: u64 = 4;
/// The memory of a band: an image of 3840×2160 with one sample is one band, and so is 1920×1080 with four. Each band
/// draws all triangles again.
const BAND_BYTES: u64 = 256 << 20;
/// The maximum number of samples and rows that a band sees: the limits of a binding and of a fragment's packed
/// position.
const BAND_SAMPLES: u64 = 8_388_000;
const BAND_ROWS: u64 = 8000;

/// The depth of the sky while it is blended and resolved, as in `glsl/ground/image/resolve.comp`; infinity times zero
/// would be NaN. It is read back as infinity.
pub const FAR: f32 = 1e36;

/// The outputs of the pass image in their order, each with its layer, or with several scalar layers, one per channel.
const OUTPUTS: &[&[Aov]] = &[
    &[Aov::Beauty],
    &[Aov::Direct],
    &[Aov::Indirect],
    &[Aov::Normal],
    &[Aov::Albedo],
    &[Aov::Ao, Aov::Depth, Aov::Diffuse],
];

/// The number of outputs of an image with these further layers.
pub fn outputs(aovs: &[Aov]) -> usize {
    let alone = aovs.iter().all(|aov| matches!(aov, Aov::Beauty | Aov::Alpha)); // both are parts of the image itself
    if alone { 1 } else { OUTPUTS.len() }
}

/// Rows of the image that are made at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    pub first_row: u32,
    pub rows: u32,
    /// The first row that it sees: gathering needs pixels beyond its own rows.
    pub first_seen: u32,
    pub seen_rows: u32,
}

pub struct ImageTarget {
    shape: ImageShape,
    /// Images of the whole size: one per entry of [`OUTPUTS`], or only the first.
    images: Vec<Image>,
}

/// The properties of an image from which the sizes of its resources follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageShape {
    /// Width in pixels.
    pub width: u32,
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// The number of outputs: see [`outputs`].
    pub outputs: usize,
    /// Whether opaque surfaces are shaded while they are drawn: [`Wants::drawn`].
    pub drawn: bool,
    /// Whether parts of a fragment's light are passes of their own, over queues.
    pub queues: bool,
    /// The resolution of gathering, if diffuse light is gathered in passes before the image.
    pub gathers: Option<GatherShape>,
}

impl ImageShape {
    /// `blended` says whether the scene has blended surfaces.
    pub fn new(
        settings: &ImageSettings,
        wants: &Wants,
        blended: bool,
        (width, height): (u32, u32),
        outputs: usize,
    ) -> Self {
        let gathers = (wants.diffuse && settings.gathers_apart()).then(|| GatherShape::new(settings, wants, blended));
        Self { width, height, samples: settings.samples, outputs, drawn: wants.drawn, queues: !wants.shades, gathers }
    }

    /// Bytes of all outputs of a pixel or sample.
    pub fn color_bytes(&self) -> u64 {
        COLOR_BYTES * self.outputs as u64
    }

    /// Whether fragments are listed, for shading or for gathering.
    pub fn lists(&self) -> bool {
        !self.drawn || self.gathers.is_some()
    }

    /// The number of kinds of surfaces whose nearest ones are kept because light is gathered for them: opaque ones, and
    /// blended ones.
    pub fn gathered_layers(&self) -> u64 {
        if self.gathers.is_some_and(|gathers| gathers.blended) { 2 } else { 1 }
    }

    /// About the number of places at which diffuse light is looked up.
    pub fn gathered_pixels(&self) -> u64 {
        let (width, height) = self.gathers.map_or((self.width, self.height), |gathers| gathers.size(self));
        u64::from(width) * u64::from(height)
    }

    /// The number of rows of a band.
    pub fn band_rows(&self) -> u32 {
        let drawn = if self.drawn { self.color_bytes() } else { 0 };
        let of_sample = SEEN_BYTES * self.gathered_layers() + drawn + if self.lists() { FRAGMENT_BYTES } else { 0 };
        let row = u64::from(self.width) * u64::from(self.samples);
        let rows = (BAND_BYTES / (row * of_sample)).min(BAND_SAMPLES / row).min(BAND_ROWS);
        if rows >= u64::from(self.height) {
            return self.height;
        }
        (rows as u32).saturating_sub(self.gathers.map_or(0, |gathers| gathers.most_beyond())).max(1)
    }

    pub fn bands(&self) -> impl Iterator<Item = Band> {
        let (shape, step) = (*self, self.band_rows());
        (0..self.height).step_by(step as usize).map(move |first_row| shape.band(first_row, step))
    }

    fn band(&self, first_row: u32, rows: u32) -> Band {
        let own = RowRange { first: first_row, count: rows.min(self.height - first_row) };
        let seen = self.gathers.map_or(own, |gathers| gathers.seen(self, own));
        Band { first_row, rows: own.count, first_seen: seen.first, seen_rows: seen.count }
    }

    /// The maximum number of rows that a band sees.
    pub fn most_seen_rows(&self) -> u32 {
        let beyond = self.gathers.map_or(0, |gathers| gathers.most_beyond());
        (self.band_rows() + beyond).min(self.height)
    }

    /// The maximum number of rows that are shaded at once.
    pub fn rows_at_once(&self) -> u32 {
        (MOST_AT_ONCE / (self.width * self.samples)).clamp(1, self.band_rows())
    }

    /// The maximum number of samples that are shaded at once.
    pub fn samples_at_once(&self) -> u64 {
        u64::from(self.rows_at_once()) * u64::from(self.width) * u64::from(self.samples)
    }

    /// Bytes of the fragments that are shaded at once.
    fn shaded_bytes(&self) -> u64 {
        fragments::shaded_bytes(self, self.samples_at_once())
    }

    /// The maximum number of pixels that a band sees.
    pub fn most_seen_pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.most_seen_rows())
    }

    /// The maximum number of samples that a band sees.
    pub fn most_seen_samples(&self) -> u64 {
        self.most_seen_pixels() * u64::from(self.samples)
    }
}

/// Sizes of all resources of an image. `blended` is the capacity for fragments of blended surfaces, if there are any.
pub fn plan(shape: &ImageShape, blended: Option<u32>) -> Vec<MemoryRow> {
    let (width, height, bytes) = (u64::from(shape.width), u64::from(shape.height), shape.color_bytes());
    let mut plan = vec![("image", width * height * bytes), visibility::plan(shape)];
    if shape.lists() {
        plan.push(fragments::plan(shape));
    }
    plan.push(if shape.drawn { drawn::plan(shape) } else { ("shaded fragments", shape.shaded_bytes()) });
    plan.extend(blended.map(|capacity| blended::plan(shape, capacity)));
    plan.extend(shape.gathers.map(|gathers| gathers.plan(shape)));
    plan
}

impl ImageTarget {
    /// # Errors
    /// There is too little memory.
    pub fn new(context: &Arc<Context>, shape: ImageShape) -> Result<Self> {
        let ImageShape { width, height, outputs, .. } = shape;
        let usage = ImageUsageFlags::STORAGE | ImageUsageFlags::SAMPLED | ImageUsageFlags::TRANSFER_SRC;
        let images = OUTPUTS[..outputs].iter().map(|layers| {
            let label = layers.iter().map(|layer| layer.name()).collect::<Vec<_>>().join(" ");
            let format = COLOR_FORMAT;
            Image::new(context, &ImageDesc { label: &label, format, width, height, usage, ..Default::default() })
        });
        Ok(Self { shape, images: images.collect::<Result<_>>()? })
    }

    pub fn shape(&self) -> &ImageShape {
        &self.shape
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.shape.width, self.shape.height)
    }

    /// Bytes of the finished image and its layers.
    pub fn bytes(&self) -> u64 {
        u64::from(self.shape.width) * u64::from(self.shape.height) * self.shape.color_bytes()
    }

    /// All images as a binding of an array.
    pub fn bind<'a>(&'a self, name: &'a str) -> Bind<'a> {
        Bind::storage_images(name, self.images.iter().map(Image::view))
    }

    /// The whole image in `GENERAL` layout: radiance, RGBA in f32.
    pub fn image(&self) -> &Image {
        &self.images[0]
    }

    /// The whole image that holds `layer`, and the channel of a scalar layer; `None` if it is not made.
    pub fn layer(&self, layer: Aov) -> Option<(&Image, Option<usize>)> {
        if layer == Aov::Alpha {
            return Some((self.image(), Some(3)));
        }
        self.images.iter().zip(OUTPUTS).find_map(|(image, layers)| {
            let channel = layers.iter().position(|other| *other == layer)?;
            Some((image, (layers.len() > 1).then_some(channel)))
        })
    }
}

/// Buffers from which the CPU reads an image.
pub struct Readback {
    width: u32,
    height: u32,
    /// One buffer per output of the target.
    buffers: Vec<Buffer>,
}

/// Memory of [`Readback::new`].
pub fn readback_plan((width, height): (u32, u32), outputs: usize) -> MemoryRow {
    ("image readback", u64::from(width) * u64::from(height) * COLOR_BYTES * outputs as u64)
}

impl Readback {
    /// A readback for targets of that size with this number of outputs.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, (width, height): (u32, u32), outputs: usize) -> Result<Self> {
        let bytes = u64::from(width) * u64::from(height) * COLOR_BYTES;
        let buffer = |_| Buffer::new(context, "image readback", bytes, BufferKind::Readback);
        Ok(Self { width, height, buffers: (0..outputs).map(buffer).collect::<Result<_>>()? })
    }

    /// Copies the image to the buffers, which can be read after the commands have finished.
    pub fn record(&self, recorder: &mut Recorder, target: &ImageTarget) {
        recorder.full_barrier(); // the image was written
        for (image, buffer) in target.images.iter().zip(&self.buffers) {
            recorder.copy_image_to_buffer(image, ImageRegion::level(image, 0), buffer, 0);
        }
    }

    /// The image with the layers `aovs`, which were drawn.
    pub fn read(&self, aovs: &[Aov]) -> Layers {
        let wanted = |layer: &&Aov| **layer == Aov::Beauty || aovs.contains(layer);
        let layers = Aov::ALL.iter().filter(wanted).filter_map(|&layer| Some((layer, self.pixels(layer)?)));
        Layers { width: self.width, height: self.height, layers: layers.collect() }
    }

    /// A layer of the image, if it was drawn.
    fn pixels(&self, layer: Aov) -> Option<Vec<[f32; 3]>> {
        if layer == Aov::Alpha {
            let texels: Vec<[f32; 4]> = self.buffers[0].read_some(0, (self.width * self.height) as usize);
            return Some(texels.iter().map(|texel| [texel[3]; 3]).collect());
        }
        let far = |v: f32| if layer == Aov::Depth && v > FAR / 64.0 { f32::INFINITY } else { v };
        let found = self.buffers.iter().zip(OUTPUTS).find(|(_, layers)| layers.contains(&layer));
        found.map(|(buffer, layers)| {
            let texels: Vec<[f32; 4]> = buffer.read_some(0, (self.width * self.height) as usize);
            let pixel = |texel: &[f32; 4]| match layers.iter().position(|other| *other == layer) {
                Some(channel) if layers.len() > 1 => [far(texel[channel]); 3],
                _ => [texel[0], texel[1], texel[2]],
            };
            texels.iter().map(pixel).collect()
        })
    }
}
