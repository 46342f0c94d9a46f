//! Gather, links and share: diffuse light is gathered at fewer pixels than the image has, or along directions that
//! differ between pixels. Then it is averaged over neighbours on the same surface without an obstacle between them. The
//! pass image upsamples it. Reads: fragments, triangles, lists, the method's light. Writes: gathered light and its
//! surfaces, band by band.

use std::sync::Arc;

use super::target::ImageShape;
use super::visibility::Nearest;
use super::{BandFrame, ImagePassDesc, LightReader, LightUse};
use crate::Result;
use crate::ground::Ground;
use crate::ground::layout::{GatherPush, OwnRowsPush, RowsPush};
use crate::ground::memory_plan::MemoryRow;
use crate::ground::wants::Wants;
use crate::settings::ImageSettings;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Format, Image, ImageDesc, ImageUsageFlags, Recorder};

const LIGHT_FORMAT: Format = Format::R16G16B16A16_SFLOAT;
const SURFACE_FORMAT: Format = Format::R32G32B32A32_SFLOAT;
/// The lights that are gathered: the method's look-up, sampled lamps, lamps in the specular lobe, and the method's
/// look-up in the specular lobe. The names are those in the passes that gather, in those that share, and in the readers
/// of the means over neighbours.
const LIGHTS: [[&str; 3]; 4] = [
    ["gathered_light", "light", "shared_light"],
    ["gathered_lamps", "lamps", "shared_lamps"],
    ["gathered_lamps_specular", "lamps_specular", "shared_lamps_specular"],
    ["gathered_mirrored", "mirrored", "shared_mirrored"],
];

/// Pixels along each side of the tiles of `gather.comp`, and workgroups of each; as in `glsl/common/tile.glsl`.
const TILE: u32 = 16;
const TILE_GROUPS: u32 = 4;
/// Pixels along each side of a workgroup of `links.comp` and `share.comp`.
const GROUP: u32 = 8;

/// How many gathered pixels beyond the nearest are searched for a surface: `WIDER` in
/// `glsl/ground/image/gathered.glsl`.
const WIDER: u32 = 2;

/// A range of rows of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowRange {
    pub first: u32,
    pub count: u32,
}

impl RowRange {
    /// Push constants of passes over these rows.
    pub fn push(self) -> RowsPush {
        RowsPush { first: self.first, end: self.first + self.count }
    }
}

/// The resolution and content of gathering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherShape {
    /// Pixels of the image per gathered pixel, along each side.
    scale: u32,
    /// Gathered rows on each side of a band's own: `GATHER_MARGIN` in `glsl/ground/image/gathered.glsl`.
    margin: u32,
    /// Whether light of specular lobes is gathered too.
    lobes: bool,
    /// Whether rays decide which gathered pixels share light: the constant `LINKED`.
    pub links: bool,
    /// Whether light is also gathered for the nearest blended surface of each gathered pixel.
    pub blended: bool,
}

impl GatherShape {
    /// `blended` says whether the scene has blended surfaces.
    pub fn new(settings: &ImageSettings, wants: &Wants, blended: bool) -> Self {
        Self {
            scale: settings.gather_resolution.scale(),
            margin: settings.interleave / 2 + 2 + WIDER,
            lobes: wants.gathers_lobes,
            links: wants.rays,
            blended,
        }
    }

    fn lights(&self) -> &'static [[&'static str; 3]] {
        if self.lobes { &LIGHTS } else { &LIGHTS[..3] }
    }

    /// Width and height of the gathered image of a whole frame.
    pub fn size(&self, shape: &ImageShape) -> (u32, u32) {
        (shape.width.div_ceil(self.scale), shape.height.div_ceil(self.scale))
    }

    /// The gathered rows that `own` rows of the image need.
    fn rows(&self, shape: &ImageShape, own: RowRange) -> RowRange {
        let first = (own.first / self.scale).saturating_sub(self.margin);
        let end = ((own.first + own.count).div_ceil(self.scale) + self.margin).min(self.size(shape).1);
        RowRange { first, count: end - first }
    }

    fn most_rows(&self, shape: &ImageShape) -> u32 {
        (shape.band_rows().div_ceil(self.scale) + 1 + 2 * self.margin).min(self.size(shape).1)
    }

    /// The rows of the image that must be visible for `own` rows: these, and the rows at which their neighbours are
    /// gathered.
    pub fn seen(&self, shape: &ImageShape, own: RowRange) -> RowRange {
        let (gathered, of) = (self.rows(shape, own), u64::from(self.size(shape).1));
        let row = |gathered: u32| u64::from(gathered) * u64::from(shape.height);
        let first = ((row(gathered.first) / of) as u32).min(own.first);
        let end = (row(gathered.first + gathered.count).div_ceil(of) as u32).max(own.first + own.count);
        RowRange { first, count: end - first }
    }

    /// The maximum number of rows beyond a band's own: a gathered pixel may be up to a row smaller than the scale.
    pub fn most_beyond(&self) -> u32 {
        2 * (self.margin + 2) * self.scale
    }

    /// Bytes of a gathered pixel: all lights before and after sharing, the surface, and the surface with its links.
    fn pixel_bytes(&self) -> u64 {
        2 * 8 * self.lights().len() as u64 + if self.links { 32 } else { 16 }
    }

    /// Memory of [`Gather::new`].
    pub fn plan(&self, shape: &ImageShape) -> MemoryRow {
        let pixels = u64::from(self.size(shape).0) * u64::from(self.most_rows(shape));
        ("gathered light", pixels * self.pixel_bytes() * shape.gathered_layers())
    }
}

pub struct Gather {
    of: GatherShape,
    gather: LightReader,
    /// The pass that finds by rays which pixels share light, if rays decide.
    link: Option<Compute>,
    share: Compute,
    opaque: Gathered,
    blended: Option<Gathered>,
}

/// The light that is gathered for the nearest surfaces of one kind.
struct Gathered {
    surfaces: Image,
    /// The surfaces with links to those that share light with them.
    linked: Option<Image>,
    lights: Vec<Image>,
    /// Means of `lights` over neighbouring pixels, which the image reads.
    shared: Vec<Image>,
}

impl Gathered {
    fn new(context: &Arc<Context>, shape: &ImageShape, of: &GatherShape) -> Result<Self> {
        let (width, height) = (of.size(shape).0, of.most_rows(shape));
        let usage = ImageUsageFlags::STORAGE | ImageUsageFlags::SAMPLED;
        let image = |label: &str, format| {
            Image::new(context, &ImageDesc { label, format, width, height, usage, ..Default::default() })
        };
        let lights = |stage: usize| {
            let names = of.lights().iter().map(move |names| names[stage].replace('_', " "));
            names.map(|name| image(&name, LIGHT_FORMAT)).collect::<Result<_>>()
        };
        Ok(Self {
            surfaces: image("gathered surfaces", SURFACE_FORMAT)?,
            linked: of.links.then(|| image("linked surfaces", SURFACE_FORMAT)).transpose()?,
            lights: lights(0)?,
            shared: lights(2)?,
        })
    }

    fn bind_surfaces<'a>(&'a self, ground: &'a Ground) -> Bind<'a> {
        let surfaces = self.linked.as_ref().unwrap_or(&self.surfaces);
        Bind::image("surfaces", surfaces.view(), &ground.scene.texel_sampler)
    }

    /// Images that the image's passes read.
    fn binds<'a>(&'a self, ground: &'a Ground) -> impl Iterator<Item = Bind<'a>> {
        let texels = &ground.scene.texel_sampler;
        // A binding that a shader declares but never reads must still be given an image.
        let shared = self.shared.iter().chain(std::iter::repeat(&self.shared[0])).zip(LIGHTS);
        std::iter::once(self.bind_surfaces(ground))
            .chain(shared.map(|(image, [.., name])| Bind::image(name, image.view(), texels)))
    }
}

impl Gather {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, shape: &ImageShape, of: GatherShape) -> Result<Self> {
        let ImagePassDesc { method, ref constants, .. } = *desc;
        let shader = format!("ground/image/gather.comp {method}");
        let gather = desc.light_reader(context, "gather", &shader, &[])?;
        let shader = if of.lobes { "ground/image/share.comp LOBES" } else { "ground/image/share.comp" };
        let share = ComputeDesc { label: "share", shader, constants };
        let link = ComputeDesc { label: "links", shader: "ground/image/links.comp", constants };
        Ok(Self {
            of,
            gather,
            link: of.links.then(|| Compute::new(context, &link)).transpose()?,
            share: Compute::new(context, &share)?,
            opaque: Gathered::new(context, shape, &of)?,
            blended: of.blended.then(|| Gathered::new(context, shape, &of)).transpose()?,
        })
    }

    fn gathered(&self, nearest: Nearest) -> &Gathered {
        match (nearest, &self.blended) {
            (Nearest::Blended, Some(blended)) => blended,
            _ => &self.opaque,
        }
    }

    /// Gathers for one band of the image. `binds` are the fragments of the nearest surfaces, and the bindings of the
    /// method's look-up in addition to the ground's.
    pub fn record<'a>(&'a self, r: &mut Recorder, of: &BandFrame<'a>, nearest: Nearest, mut binds: Vec<Bind<'a>>) {
        let gathered = self.gathered(nearest);
        let (ground, rows, width) = (of.ground(), self.rows(of), self.of.size(of.shape()).0);
        let groups = [width.div_ceil(GROUP), rows.count.div_ceil(GROUP), 1];
        binds.push(Bind::storage_image("gathered_surfaces", gathered.surfaces.view()));
        // An image that is declared but never written must still be given.
        let lights = gathered.lights.iter().chain(std::iter::repeat(&gathered.lights[0])).zip(LIGHTS);
        binds.extend(lights.map(|(image, [name, ..])| Bind::storage_image(name, image.view())));
        let pass = self.gather.for_use(of.light);
        let binds = pass.select(&binds);
        r.in_parts(rows.count.div_ceil(TILE), 1, |r, part| {
            let (first, end) = (part.start * TILE, (part.end * TILE).min(rows.count));
            let push = GatherPush { first_row: rows.first, first, end, first_seen: of.band.first_seen };
            r.dispatch(pass, &binds, &push, [TILE_GROUPS, width.div_ceil(TILE), part.len() as u32]);
        });
        r.full_barrier();
        let texels = &ground.scene.texel_sampler;
        let push = OwnRowsPush { rows: rows.count };
        if let (Some(link), Some(surfaces)) = (&self.link, &gathered.linked) {
            let mut binds = ground.image_binds();
            binds.push(Bind::image("gathered", gathered.surfaces.view(), texels));
            binds.push(Bind::storage_image("linked_surfaces", surfaces.view()));
            r.dispatch(link, &link.select(&binds), &push, groups);
            r.full_barrier();
        }
        if of.light == LightUse::Asks {
            return; // nothing was gathered yet
        }
        let mut binds = vec![Bind::buffer("frame", &ground.frame), gathered.bind_surfaces(ground)];
        let of_lights = gathered.lights.iter().zip(LIGHTS);
        binds.extend(of_lights.map(|(image, [_, name, _])| Bind::image(name, image.view(), texels)));
        let of_shared = gathered.shared.iter().zip(LIGHTS);
        binds.extend(of_shared.map(|(image, [.., name])| Bind::storage_image(name, image.view())));
        r.dispatch(&self.share, &binds, &push, groups);
        r.full_barrier();
    }

    fn rows(&self, of: &BandFrame) -> RowRange {
        self.of.rows(of.shape(), RowRange { first: of.band.first_row, count: of.band.rows })
    }

    /// Images that passes read to shade surfaces of this kind.
    pub fn binds<'a>(&'a self, ground: &'a Ground, nearest: Nearest) -> impl Iterator<Item = Bind<'a>> {
        self.gathered(nearest).binds(ground)
    }

    /// Bytes that a band writes.
    pub fn bytes(&self, of: &BandFrame) -> u64 {
        u64::from(self.rows(of).count)
            * u64::from(self.of.size(of.shape()).0)
            * self.of.pixel_bytes()
            * of.shape().gathered_layers()
    }
}
