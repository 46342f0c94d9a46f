//! Shading where triangles are small: each triangle of a pixel becomes one fragment of a list; these are shaded packed, one beside the other, and
//! what they show is spread over the samples that see them. A rasteriser shades squares of pixels of one triangle each, and among small triangles
//! most of a square is empty.
//! Reads: what is seen, triangles, materials, the method's light. Writes: radiance of each sample.

use std::sync::Arc;

use super::ImagePassDesc;
use super::target::{Band, COLOR_FORMAT, DEPTH_FORMAT, ImageShape, ImageTarget};
use crate::Result;
use crate::ground::Ground;
use crate::ground::layout::{FragmentsPush, PixelsPush};
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, Buffer, BufferKind, ColorTarget, CompareOp, Compute, ComputeDesc, Context, DepthDesc, DrawCall, Image,
    ImageDesc, ImageUsageFlags, Raster, RasterDesc, RasterPass, Recorder, RenderTarget,
};

/// An entry of the list.
const FRAGMENT_BYTES: u64 = 8;
const COUNT_BYTES: u64 = 4;
/// Where a pixel's fragments begin.
const PIXEL_BYTES: u64 = 4;
/// Threads of a workgroup of fragments.comp.
const GROUP: u32 = 64;
/// Workgroups of one dispatch: every device takes so many, and threads go on beyond.
const MOST_GROUPS: u32 = 65535;

/// Of a sample, apart from what is seen.
pub fn sample_bytes(shape: &ImageShape) -> u64 {
    FRAGMENT_BYTES + shape.color_bytes()
}

/// Bytes of what [`Fragments::new`] makes.
pub fn plan(shape: &ImageShape) -> MemoryRow {
    let pixels = u64::from(shape.width) * u64::from(shape.band_rows());
    ("fragments", pixels * (u64::from(shape.samples) * sample_bytes(shape) + PIXEL_BYTES) + COUNT_BYTES)
}

pub struct Fragments {
    list: Buffer,
    of_pixels: Buffer,
    shaded: Vec<Image>,
    lister: Compute,
    shade: Raster,
    spread: Raster,
}

/// Rows of a band.
pub struct Part<'a> {
    pub band: &'a Band,
    pub first_row: u32,
    pub rows: u32,
}

/// The inputs of which fragments are shaded.
pub struct FragmentsFrame<'a> {
    pub target: &'a ImageTarget,
    /// [`Visibility::bind`](super::visibility::Visibility::bind).
    pub seen: Bind<'a>,
    /// Bindings of the shading pass.
    pub binds: &'a [Bind<'a>],
}

impl Fragments {
    /// `fragment`: what shades one.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, target: &ImageTarget, fragment: &str) -> Result<Self> {
        let shape = target.shape();
        let (width, samples, outputs) = (shape.width, shape.samples, shape.outputs);
        let rows = shape.band_rows();
        let pixels = u64::from(width) * u64::from(rows);
        let buffer = |label: &str, bytes| Buffer::new(context, label, bytes, BufferKind::Device);
        let shaded = |index: usize| {
            let (label, format) = (format!("fragments {}", index + 3), COLOR_FORMAT);
            let (height, usage) = (rows * samples, ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::SAMPLED);
            Image::new(context, &ImageDesc { label: &label, format, width, height, usage, ..Default::default() })
        };
        let formats = vec![COLOR_FORMAT; outputs];
        let shade = RasterDesc {
            label: "image",
            vertex: "ground/image/packed.vert",
            fragment: Some(fragment),
            constants: &desc.constants,
            color_formats: &formats,
            ..Default::default()
        };
        let spread = RasterDesc {
            label: "spread",
            vertex: "ground/image/whole.vert",
            fragment: Some(if outputs > 1 { "ground/image/spread.frag AOVS" } else { "ground/image/spread.frag" }),
            color_formats: &formats,
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::ALWAYS, write: false }),
            samples,
            ..Default::default()
        };
        let lister =
            if samples > 1 { "ground/image/fragments.comp MULTISAMPLED" } else { "ground/image/fragments.comp" };
        let lister = ComputeDesc { label: "fragments", shader: lister, ..Default::default() };
        Ok(Self {
            list: buffer("fragments 1", COUNT_BYTES + pixels * u64::from(samples) * FRAGMENT_BYTES)?,
            of_pixels: buffer("fragments 2", PIXEL_BYTES * pixels)?,
            shaded: (0..outputs).map(shaded).collect::<Result<_>>()?,
            lister: Compute::new(context, &lister)?,
            shade: Raster::new(context, &shade)?,
            spread: Raster::new(context, &spread)?,
        })
    }

    /// Shades what is seen in some rows of a band.
    pub fn shade<'a>(&'a self, r: &mut Recorder, frame: &FragmentsFrame<'_>, part: &Part) {
        let FragmentsFrame { target, seen, binds } = frame;
        let width = target.width;
        let pixels = PixelsPush { first: part.first_row * width, end: (part.first_row + part.rows) * width };
        r.fill(&self.list, 0, COUNT_BYTES, 0);
        r.full_barrier();
        let mut lists = self.binds().to_vec();
        lists.push(seen.clone());
        let groups = (pixels.end - pixels.first).div_ceil(GROUP).min(MOST_GROUPS);
        r.dispatch(&self.lister, &lists, &pixels, [groups, 1, 1]);
        r.full_barrier();
        let mut all = binds.to_vec();
        all.extend(self.binds());
        let written = |image: &'a Image| ColorTarget::overwritten(image.attachment_view(0));
        let colors: Vec<_> = self.shaded.iter().map(written).collect();
        let height = part.rows * target.shape().samples;
        let push = FragmentsPush { first_row: part.band.first_row, width, rows: height };
        r.raster(&RenderTarget { colors: &colors, width, height, ..Default::default() }, |pass| {
            let call = DrawCall::Direct { vertices: 3, instances: 1 };
            pass.draw(&self.shade, &self.shade.select(&all), &push, call);
        });
        r.full_barrier();
    }

    /// Spreads it over the samples of these rows.
    pub fn spread(&self, pass: &mut RasterPass<'_>, ground: &Ground, target: &ImageTarget) {
        let mut binds = self.binds().to_vec();
        binds.push(Bind::images("shaded", self.shaded.iter().map(Image::view), &ground.scene.texel_sampler));
        let push = FragmentsPush { first_row: 0, width: target.width, rows: 0 };
        let call = DrawCall::Direct { vertices: 3, instances: target.shape().samples };
        pass.draw(&self.spread, &self.spread.select(&binds), &push, call);
    }

    fn binds(&self) -> [Bind<'_>; 2] {
        [Bind::buffer("fragment_count", &self.list), Bind::buffer("pixel_fragments", &self.of_pixels)]
    }
}
