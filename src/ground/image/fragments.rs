//! What the image sees, and its shading: a visibility buffer holds the triangle that every sample sees; each triangle of a pixel becomes one
//! fragment of a list; fragments are shaded packed, one beside the other, however small their triangles are, and spread over the samples that see
//! them. A rasteriser shades squares of pixels of one triangle each: among small triangles most of a square is empty.
//! Reads: triangles, materials, the method's light. Writes: radiance of each sample.

use std::sync::Arc;

use super::ImagePassDesc;
use super::target::{Band, COLOR_BYTES, COLOR_FORMAT, DEPTH_FORMAT, ImageTarget};
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::Features;
use crate::ground::layout::{BandPush, FragmentsPush, PixelsPush};
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{
    Bind, Buffer, BufferKind, ColorTarget, CompareOp, Compute, ComputeDesc, Context, DepthDesc, DrawCall, Format,
    Image, ImageDesc, ImageDim, ImageUsageFlags, Load, Raster, RasterDesc, RasterPass, Recorder, RenderTarget,
};

const SEEN_FORMAT: Format = Format::R32_UINT;
/// Of a sample: what it sees, a fragment, and what is shaded for it apart from the colours.
pub const SAMPLE_BYTES: u64 = 4 + FRAGMENT_BYTES;
const FRAGMENT_BYTES: u64 = 8;
const COUNT_BYTES: u64 = 4;
/// Threads of a workgroup of fragments.comp.
const GROUP: u32 = 64;
/// Workgroups of one dispatch: every device takes so many, and threads go on beyond.
const MOST_GROUPS: u32 = 65535;

pub struct Fragments {
    seen: Image,
    list: Buffer,
    of_pixels: Buffer,
    shaded: Vec<Image>,
    visibility: Raster,
    lister: Compute,
    shade: Raster,
    spread: Raster,
}

/// Bytes of what [`Fragments::new`] makes for bands of so many rows.
pub fn plan(width: u32, band_rows: u32, samples: u32, outputs: usize) -> MemoryRow {
    let pixels = u64::from(width) * u64::from(band_rows);
    let of_sample = SAMPLE_BYTES + COLOR_BYTES * outputs as u64;
    ("fragments", pixels * (u64::from(samples) * of_sample + 4) + COUNT_BYTES)
}

impl Fragments {
    /// `fragment`: what shades one.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, target: &ImageTarget, fragment: &str) -> Result<Self> {
        let (samples, outputs) = (desc.settings.samples, target.outputs());
        let (width, rows) = (target.width, target.band_rows());
        let image = |label: &str, format, (height, samples), usage| {
            let dim = ImageDim::D2;
            Image::new(context, &ImageDesc { label, dim, format, width, height, samples, usage, ..Default::default() })
        };
        let drawn = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::SAMPLED;
        let pixels = u64::from(width) * u64::from(rows);
        let buffer = |label: &str, bytes| Buffer::new(context, label, bytes, BufferKind::Device);
        let formats = vec![COLOR_FORMAT; outputs];
        let masked = desc.features.has(Features::MASK);
        let visibility = RasterDesc {
            label: "visibility",
            vertex: "ground/image/image.vert",
            fragment: Some(if masked { "ground/image/visibility.frag MASKED" } else { "ground/image/visibility.frag" }),
            constants: desc.constants,
            color_formats: &[SEEN_FORMAT],
            depth: Some(DepthDesc { format: DEPTH_FORMAT, compare: CompareOp::GREATER, write: true }),
            samples,
            ..Default::default()
        };
        let shade = RasterDesc {
            label: "image",
            vertex: "ground/image/packed.vert",
            fragment: Some(fragment),
            constants: desc.constants,
            color_formats: &formats,
            ..Default::default()
        };
        let spread = RasterDesc {
            label: "spread",
            vertex: "ground/image/spread.vert",
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
            seen: image("fragments 1", SEEN_FORMAT, (rows, samples), drawn)?,
            list: buffer("fragments 2", COUNT_BYTES + pixels * u64::from(samples) * FRAGMENT_BYTES)?,
            of_pixels: buffer("fragments 3", 4 * pixels)?,
            shaded: (0..outputs)
                .map(|index| image(&format!("fragments {}", index + 4), COLOR_FORMAT, (rows * samples, 1), drawn))
                .collect::<Result<_>>()?,
            visibility: Raster::new(context, &visibility)?,
            lister: Compute::new(context, &lister)?,
            shade: Raster::new(context, &shade)?,
            spread: Raster::new(context, &spread)?,
        })
    }

    /// Finds what the samples of a band see.
    pub fn see(&self, r: &mut Recorder, (ground, binds): (&Ground, &[Bind<'_>]), target: &ImageTarget, band: &Band) {
        let colors = [ColorTarget {
            view: self.seen.attachment_view(0),
            resolve: None,
            load: Load::Clear([0.0; 4]), // sees nothing
            store: true,
        }];
        let binds = self.visibility.select(binds);
        target.depth_target(&colors, band).draw_in_parts(r, |pass| {
            pass.draw(&self.visibility, &binds, &BandPush { first_row: band.first_row }, ground.recorded());
        });
        r.full_barrier();
    }

    /// Shades what is seen in some rows of a band.
    pub fn shade(
        &self,
        r: &mut Recorder,
        (ground, binds): (&Ground, &[Bind<'_>]),
        (width, samples): (u32, u32),
        part: &Part,
    ) {
        let pixels = PixelsPush { first: part.first_row * width, end: (part.first_row + part.rows) * width };
        r.fill(&self.list, 0, COUNT_BYTES, 0);
        r.full_barrier();
        let mut lists = self.lists().to_vec();
        lists.push(Bind::image("seen", self.seen.view(), &ground.scene.texel_sampler));
        let groups = (pixels.end - pixels.first).div_ceil(GROUP).min(MOST_GROUPS);
        r.dispatch(&self.lister, &self.lister.select(&lists), &pixels, [groups, 1, 1]);
        r.full_barrier();
        let colors: Vec<_> = self
            .shaded
            .iter()
            .map(|image| ColorTarget {
                view: image.attachment_view(0),
                resolve: None,
                load: Load::DontCare,
                store: true,
            })
            .collect();
        let height = part.rows * samples;
        let mut all = binds.to_vec();
        all.extend(self.lists());
        let push = FragmentsPush { first_row: part.band.first_row, width, rows: height };
        r.raster(&RenderTarget { colors: &colors, width, height, ..Default::default() }, |pass| {
            let call = DrawCall::Direct { vertices: 3, instances: 1 };
            pass.draw(&self.shade, &self.shade.select(&all), &push, call);
        });
        r.full_barrier();
    }

    /// Spreads it over the samples.
    pub fn spread(&self, pass: &mut RasterPass<'_>, ground: &Ground, (width, samples): (u32, u32)) {
        let mut binds = self.lists().to_vec();
        let views = self.shaded.iter().map(Image::view);
        binds.push(Bind::images("shaded", views, &ground.scene.texel_sampler));
        let push = FragmentsPush { first_row: 0, width, rows: 0 };
        let call = DrawCall::Direct { vertices: 3, instances: samples };
        pass.draw(&self.spread, &self.spread.select(&binds), &push, call);
    }

    fn lists(&self) -> [Bind<'_>; 2] {
        [Bind::buffer("fragment_count", &self.list), Bind::buffer("pixel_fragments", &self.of_pixels)]
    }
}

/// Rows of a band.
pub struct Part<'a> {
    pub band: &'a Band,
    pub first_row: u32,
    pub rows: u32,
}
