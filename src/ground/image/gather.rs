//! Gather and share: diffuse light at fewer pixels than the image has, or along directions that differ from pixel to pixel,
//! then the mean over neighbours on the same surface. The pass image brings it up to its pixels.
//! Reads: triangles, lists, the method's light. Writes: gathered light and the surfaces that it belongs to, band by band.

use std::sync::Arc;

use super::ImagePassDesc;
use super::target::{Band, DEPTH_FORMAT, ImageShape, ImageTarget};
use super::visibility::{SEEN_BYTES, Visibility, VisibilityDesc};
use crate::Result;
use crate::ground::Ground;
use crate::ground::layout::{BandPush, SharePush};
use crate::ground::memory_plan::MemoryRow;
use crate::settings::ImageSettings;
use crate::vk::{
    Bind, ColorTarget, Compute, ComputeDesc, Context, DepthTarget, DrawCall, Format, Image, ImageDesc, ImageUsageFlags,
    Load, Raster, RasterDesc, Recorder, Rect, RenderTarget,
};

const LIGHT_FORMAT: Format = Format::R16G16B16A16_SFLOAT;
const SURFACE_FORMAT: Format = Format::R32G32B32A32_SFLOAT;
/// What is gathered: what the method looks up, sampled lamps, these in the specular lobe, and what the method looks up in that. Names of
/// what the pass `gather` finds, as the pass `share` has them, and of the means over neighbours.
const LIGHTS: [(&str, &str); 4] = [
    ("light", "shared_light"),
    ("lamps", "shared_lamps"),
    ("lamps_specular", "shared_lamps_specular"),
    ("mirrored", "shared_mirrored"),
];

fn lights(lobes: bool) -> &'static [(&'static str, &'static str)] {
    if lobes { &LIGHTS } else { &LIGHTS[..3] }
}

/// Bytes of a gathered pixel: every light before and after sharing, surface, what is seen, depth.
fn pixel_bytes(lobes: bool) -> u64 {
    2 * 8 * lights(lobes).len() as u64 + 16 + SEEN_BYTES + 4
}

/// Pixels along each side of a workgroup of `share.comp`.
const GROUP: u32 = 8;

/// Gathered pixels beyond the nearest that a surface is looked for among: `WIDER` in `glsl/ground/image/gathered.glsl`.
const WIDER: u32 = 2;

/// How much of the gathered image one band of rows needs.
#[derive(Clone, Copy)]
struct Extent {
    scale: u32,
    /// Rows beyond a band's own on each side: `GATHER_MARGIN` in `glsl/ground/image/gathered.glsl`.
    margin: u32,
    /// Of the whole image, gathered pixels.
    width: u32,
    height: u32,
}

impl Extent {
    fn new(settings: &ImageSettings, (width, height): (u32, u32)) -> Self {
        let scale = settings.gather_resolution.scale();
        Self {
            scale,
            margin: settings.interleave / 2 + 1 + WIDER,
            width: width.div_ceil(scale),
            height: height.div_ceil(scale),
        }
    }

    /// First gathered row and their number for a band of the image.
    fn rows(&self, band: &Band) -> (u32, u32) {
        let first = (band.first_row / self.scale).saturating_sub(self.margin);
        let end = ((band.first_row + band.rows).div_ceil(self.scale) + self.margin).min(self.height);
        (first, end - first)
    }

    fn most_rows(&self, band_rows: u32) -> u32 {
        (band_rows.div_ceil(self.scale) + 1 + 2 * self.margin).min(self.height)
    }
}

/// Bytes of what [`Gather::new`] makes; `lobes`: of [`ImagePassDesc`].
pub fn plan(settings: &ImageSettings, lobes: bool, shape: &ImageShape) -> MemoryRow {
    let extent = Extent::new(settings, (shape.width, shape.height));
    let pixels = u64::from(extent.width) * u64::from(extent.most_rows(shape.band_rows()));
    ("gathered light", pixels * pixel_bytes(lobes))
}

pub struct Gather {
    extent: Extent,
    surfaces: Image,
    lights: Vec<Image>,
    depth: Image,
    /// What neighbours share; the image reads this.
    shared: Vec<Image>,
    visibility: Visibility,
    gather: Raster,
    share: Compute,
}

impl Gather {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, target: &ImageTarget) -> Result<Self> {
        let ImagePassDesc { method, ref constants, .. } = *desc;
        let fragment = format!("ground/image/gather.frag {method}");
        let mut formats = vec![SURFACE_FORMAT];
        formats.resize(1 + lights(desc.lobes).len(), LIGHT_FORMAT);
        let gather = RasterDesc {
            label: "gather",
            vertex: "ground/image/whole.vert",
            fragment: Some(&fragment),
            constants,
            color_formats: &formats,
            ..Default::default()
        };
        let extent = Extent::new(desc.settings, (target.width, target.height));
        let (width, height) = (extent.width, extent.most_rows(target.shape().band_rows()));
        let image = |label: &str, format, usage| {
            Image::new(context, &ImageDesc { label, format, width, height, usage, ..Default::default() })
        };
        let images = |stage: &str, usage| -> Result<Vec<Image>> {
            lights(desc.lobes).iter().map(|(name, _)| image(&format!("{stage} {name}"), LIGHT_FORMAT, usage)).collect()
        };
        let drawn = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::SAMPLED;
        Ok(Self {
            extent,
            surfaces: image("gathered surfaces", SURFACE_FORMAT, drawn)?,
            lights: images("gathered", drawn)?,
            depth: image("gathered depth", DEPTH_FORMAT, ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)?,
            shared: images("shared", ImageUsageFlags::STORAGE | ImageUsageFlags::SAMPLED)?,
            visibility: Visibility::new(context, desc, &VisibilityDesc { gathered: true, width, height, samples: 1 })?,
            gather: Raster::new(context, &gather)?,
            share: Compute::new(
                context,
                &ComputeDesc {
                    label: "share",
                    shader: if desc.lobes { "ground/image/share.comp LOBES" } else { "ground/image/share.comp" },
                    constants,
                },
            )?,
        })
    }

    /// Gathers for one band of the image. `look_up`: what the method's look-up binds.
    pub fn record<'a>(&'a self, r: &mut Recorder, ground: &Ground, look_up: &[Bind<'_>], band: &Band) {
        let (first_row, rows) = self.extent.rows(band);
        r.full_barrier(); // the method wrote its light; the band before read the same targets
        let Extent { width, height, .. } = self.extent;
        let written = |image: &'a Image| ColorTarget::overwritten(image.attachment_view(0));
        let depth = DepthTarget { view: self.depth.attachment_view(0), load: Load::Clear(0.0), store: false };
        let viewport = Some(Rect { x: 0, y: -(first_row as i32), width, height });
        let target = RenderTarget { depth: Some(depth), width, height: rows, viewport, ..Default::default() };
        self.visibility.record(r, ground, &target, first_row);
        let mut binds = ground.image_binds();
        binds.extend_from_slice(look_up);
        binds.push(self.visibility.bind(ground));
        let binds = self.gather.select(&binds);
        let colors: Vec<_> = std::iter::once(&self.surfaces).chain(&self.lights).map(written).collect();
        let target = RenderTarget { colors: &colors, width, height: rows, ..Default::default() };
        let call = DrawCall::Direct { vertices: 3, instances: 1 };
        target.draw_in_parts(r, |pass| pass.draw(&self.gather, &binds, &BandPush { first_row }, call));
        r.full_barrier();
        let texels = &ground.scene.texel_sampler;
        let surfaces = Bind::image("surfaces", self.surfaces.view(), texels);
        let mut binds = vec![Bind::buffer("frame", &ground.frame), surfaces];
        for ((light, shared), &(name, shared_name)) in self.lights.iter().zip(&self.shared).zip(&LIGHTS) {
            binds.push(Bind::image(name, light.view(), texels));
            binds.push(Bind::storage_image(shared_name, shared.view()));
        }
        let groups = [self.extent.width.div_ceil(GROUP), rows.div_ceil(GROUP), 1];
        r.dispatch(&self.share, &binds, &SharePush { rows }, groups);
    }

    /// What the image reads.
    pub fn binds<'a>(&'a self, ground: &'a Ground) -> impl Iterator<Item = Bind<'a>> {
        let texels = &ground.scene.texel_sampler;
        // What a shader may read but never does must be given something.
        let shared = self.shared.iter().chain(std::iter::repeat(&self.shared[0])).zip(&LIGHTS);
        std::iter::once(Bind::image("surfaces", self.surfaces.view(), texels))
            .chain(shared.map(|(image, (_, name))| Bind::image(name, image.view(), texels)))
    }

    /// Bytes that a band writes.
    pub fn bytes(&self, band: &Band) -> u64 {
        u64::from(self.extent.rows(band).1)
            * u64::from(self.extent.width)
            * pixel_bytes(self.lights.len() == LIGHTS.len())
    }
}
