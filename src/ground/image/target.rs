//! What the image pass draws into, and how the image comes back. Multisampled targets hold one band of rows, which is resolved
//! and copied into the whole image, so that an image of any size needs little memory; the image stays on the device until a
//! [`Readback`] copies it out.

use std::sync::Arc;

use super::fragments;
use super::visibility::SEEN_BYTES;
use crate::Result;
use crate::ground::memory_plan::MemoryRow;
use crate::layers::{Aov, Layers};
use crate::settings::ImageSettings;
use crate::vk::{
    Buffer, BufferKind, ColorTarget, Context, DepthTarget, Format, Image, ImageDesc, ImageRegion, ImageUsageFlags,
    Load, Recorder, Rect, RenderTarget,
};

pub const COLOR_FORMAT: Format = Format::R32G32B32A32_SFLOAT;
pub const DEPTH_FORMAT: Format = Format::D32_SFLOAT;
const COLOR_BYTES: u64 = 16;
const DEPTH_BYTES: u64 = 4;
/// Of what a band takes: a 768×768 image with 4 samples is one. Each draws all triangles anew.
const BAND_BYTES: u64 = 110 << 20;
/// Rows of samples that a band has at most: each may be a row of fragments, and this is as high as any device's images may be.
const BAND_SAMPLE_ROWS: u32 = 4096;

/// Depth of the sky while it is blended and resolved; infinity times zero would be NaN. Read back as infinity.
pub const FAR: f32 = 1e36;

/// The outputs of `image.frag` in their order: what each holds, a layer or, channel by channel, several of one number.
const OUTPUTS: &[&[Aov]] = &[
    &[Aov::Beauty],
    &[Aov::Direct],
    &[Aov::Indirect],
    &[Aov::Normal],
    &[Aov::Albedo],
    &[Aov::Ao, Aov::Depth, Aov::Diffuse],
];

/// How many outputs an image with these further layers takes.
pub fn outputs(aovs: &[Aov]) -> usize {
    let alone = aovs.iter().all(|aov| matches!(aov, Aov::Beauty | Aov::Alpha)); // both are of the image itself
    if alone { 1 } else { OUTPUTS.len() }
}

/// Rows that are drawn at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    pub first_row: u32,
    pub rows: u32,
}

struct OutputTarget {
    /// Of a band, multisampled; absent with one sample per pixel.
    samples: Option<Image>,
    /// Of a band, resolved; absent where the whole image is one band.
    band: Option<Image>,
    /// The whole image.
    image: Image,
}

pub struct ImageTarget {
    pub width: u32,
    pub height: u32,
    shape: ImageShape,
    /// One per entry of [`OUTPUTS`], or the first alone.
    outputs: Vec<OutputTarget>,
    depth: Image,
}

/// What sizes of an image's targets depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageShape {
    /// Pixels.
    pub width: u32,
    pub height: u32,
    /// Per pixel.
    pub samples: u32,
    /// See [`outputs`].
    pub outputs: usize,
    /// Whether [`Fragments`](super::fragments::Fragments) are shaded.
    pub packed: bool,
}

impl ImageShape {
    /// `triangles`: of the scene.
    pub fn new(settings: &ImageSettings, size: (u32, u32), outputs: usize, triangles: u32) -> Self {
        let (width, height) = size;
        Self { width, height, samples: settings.samples, outputs, packed: settings.shading.packs(size, triangles) }
    }

    /// Bytes of all outputs of a pixel or sample.
    pub fn color_bytes(&self) -> u64 {
        COLOR_BYTES * self.outputs as u64
    }

    /// Rows of a band.
    pub fn band_rows(&self) -> u32 {
        let packed = if self.packed { fragments::sample_bytes(self) } else { 0 };
        let of_sample = self.color_bytes() + DEPTH_BYTES + SEEN_BYTES + packed;
        let row = u64::from(self.width) * u64::from(self.samples) * of_sample;
        ((BAND_BYTES / row).max(1) as u32).min(BAND_SAMPLE_ROWS / self.samples).min(self.height)
    }
}

/// Sizes of everything that [`ImageTarget::new`] makes, and of what is seen and listed of a band.
pub fn plan(shape: &ImageShape) -> Vec<MemoryRow> {
    let (width, height, rows) = (u64::from(shape.width), u64::from(shape.height), u64::from(shape.band_rows()));
    let (samples, bytes) = (u64::from(shape.samples), shape.color_bytes());
    let multisampled = if samples > 1 { width * rows * samples * bytes } else { 0 };
    let resolved = if rows < height { width * rows * bytes } else { 0 };
    let mut plan = vec![
        ("image band, samples", multisampled + width * rows * samples * DEPTH_BYTES),
        ("image band, resolved", resolved),
        ("image", width * height * bytes),
        ("visibility", width * rows * samples * SEEN_BYTES),
    ];
    if shape.packed {
        plan.push(fragments::plan(shape));
    }
    plan
}

impl ImageTarget {
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, shape: ImageShape) -> Result<Self> {
        let ImageShape { width, height, samples, outputs, .. } = shape;
        let band_rows = shape.band_rows();
        let image = |label: &str, format: Format, (height, samples): (u32, u32), usage: ImageUsageFlags| {
            Image::new(context, &ImageDesc { label, format, width, height, samples, usage, ..Default::default() })
        };
        let color = ImageUsageFlags::COLOR_ATTACHMENT;
        let source = color | ImageUsageFlags::TRANSFER_SRC;
        let whole = source | ImageUsageFlags::TRANSFER_DST | ImageUsageFlags::SAMPLED;
        let targets = OUTPUTS[..outputs].iter().map(|layers| {
            let name = layers.iter().map(|layer| layer.name()).collect::<Vec<_>>().join(" ");
            let samples = (samples > 1)
                .then(|| image(&format!("{name}, samples"), COLOR_FORMAT, (band_rows, samples), color))
                .transpose()?;
            let band = (band_rows < height)
                .then(|| image(&format!("{name}, band"), COLOR_FORMAT, (band_rows, 1), source))
                .transpose()?;
            Ok(OutputTarget { samples, band, image: image(&name, COLOR_FORMAT, (height, 1), whole)? })
        });
        Ok(Self {
            width,
            height,
            shape,
            outputs: targets.collect::<Result<_>>()?,
            depth: image("depth", DEPTH_FORMAT, (band_rows, samples), ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)?,
        })
    }

    pub fn shape(&self) -> &ImageShape {
        &self.shape
    }

    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Bytes of the finished image and its layers.
    pub fn bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * COLOR_BYTES * self.outputs.len() as u64
    }

    pub fn bands(&self) -> impl Iterator<Item = Band> {
        let (height, step) = (self.height, self.shape.band_rows());
        (0..height).step_by(step as usize).map(move |first_row| Band { first_row, rows: step.min(height - first_row) })
    }

    /// `sky`: radiance behind everything.
    pub fn colors(&self, sky: [f32; 3]) -> Vec<ColorTarget<'_>> {
        let color = self.outputs.iter().zip(OUTPUTS).map(|(target, layers)| {
            let [r, g, b] = match layers {
                [layer] => background(*layer, sky),
                // One number each.
                _ => std::array::from_fn(|channel| background(layers[channel], sky)[0]),
            };
            let load = Load::Clear([r, g, b, 0.0]); // alpha: what surfaces cover
            let resolved = target.band.as_ref().unwrap_or(&target.image).attachment_view(0);
            match &target.samples {
                Some(samples) => {
                    ColorTarget { view: samples.attachment_view(0), resolve: Some(resolved), load, store: false }
                }
                None => ColorTarget { view: resolved, resolve: None, load, store: true },
            }
        });
        color.collect()
    }

    /// A band's part of the image; `colors` from [`ImageTarget::colors`], or none where its depth is drawn.
    pub fn render_target<'a>(&'a self, colors: &'a [ColorTarget<'a>], band: &Band) -> RenderTarget<'a> {
        let load = if colors.is_empty() { Load::Clear(0.0) } else { Load::Load };
        RenderTarget {
            colors,
            depth: Some(DepthTarget { view: self.depth.attachment_view(0), load, store: true }),
            width: self.width,
            height: band.rows,
            viewport: Some(Rect { x: 0, y: -(band.first_row as i32), width: self.width, height: self.height }),
            ..Default::default()
        }
    }

    /// Copies a band into the whole image, where it was not drawn there.
    pub fn copy_band(&self, recorder: &mut Recorder, band: &Band) {
        for target in &self.outputs {
            let Some(from) = &target.band else { continue };
            recorder.full_barrier(); // the band's resolve
            let rows = ImageRegion::rows(from, 0, 0, band.rows);
            recorder.copy_image(from, rows, &target.image, [0, band.first_row, 0]);
        }
    }

    /// The whole image, in `GENERAL` layout: radiance, RGBA in f32.
    pub fn image(&self) -> &Image {
        &self.outputs[0].image
    }

    /// The whole image that holds `layer`, and which of its channels where it is one number; `None` where it is not drawn.
    pub fn layer(&self, layer: Aov) -> Option<(&Image, Option<usize>)> {
        if layer == Aov::Alpha {
            return Some((self.image(), Some(3)));
        }
        self.outputs.iter().zip(OUTPUTS).find_map(|(output, layers)| {
            let channel = layers.iter().position(|other| *other == layer)?;
            Some((&output.image, (layers.len() > 1).then_some(channel)))
        })
    }
}

/// Where the CPU reads an image from.
pub struct Readback {
    width: u32,
    height: u32,
    /// One per output of the target.
    buffers: Vec<Buffer>,
}

/// Size of everything that [`Readback::new`] makes.
pub fn readback_plan((width, height): (u32, u32), outputs: usize) -> MemoryRow {
    ("image readback", u64::from(width) * u64::from(height) * COLOR_BYTES * outputs as u64)
}

impl Readback {
    /// For images of `target`.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, target: &ImageTarget) -> Result<Self> {
        let bytes = target.bytes() / target.outputs.len() as u64;
        let buffer = |output: &OutputTarget| {
            let label = format!("{}, readback", output.image.label());
            Buffer::new(context, &label, bytes, BufferKind::Readback)
        };
        let buffers = target.outputs.iter().map(buffer).collect::<Result<_>>()?;
        Ok(Self { width: target.width, height: target.height, buffers })
    }

    /// Copies the image out; to be read once the commands were waited for.
    pub fn record(&self, recorder: &mut Recorder, target: &ImageTarget) {
        recorder.full_barrier(); // the image was drawn or copied
        for (output, buffer) in target.outputs.iter().zip(&self.buffers) {
            recorder.copy_image_to_buffer(&output.image, ImageRegion::level(&output.image, 0), buffer, 0);
        }
    }

    /// The image; `aovs` chooses among the layers drawn.
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

/// What a pixel shows where there is no surface.
fn background(layer: Aov, sky: [f32; 3]) -> [f32; 3] {
    match layer {
        Aov::Beauty | Aov::Direct => sky,
        Aov::Ao => [1.0; 3],
        Aov::Depth => [FAR; 3],
        Aov::Alpha | Aov::Indirect | Aov::Normal | Aov::Albedo | Aov::Diffuse => [0.0; 3],
    }
}
