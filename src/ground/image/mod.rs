//! The image: the visible triangle of every sample, then for each triangle in a pixel the direct light of its samples
//! and one look-up of the method, then blended surfaces over them, back to front. Large images are made in bands of
//! rows to limit memory. Diffuse light may be gathered in passes before. Reads: triangles, lists, the method's light.
//! Writes: radiance, f32.

mod blended;
mod drawn;
mod fragments;
pub mod gather;
pub mod given;
mod resolve;
pub mod target;
mod visibility;

use std::sync::Arc;

use super::constants::{Features, with};
use super::layout::BandPush;
use super::wants::OnDemand;
use super::{Counts, Ground};
use crate::Result;
use crate::scene::Scene;
use crate::vk::{Bind, Compute, ComputeDesc, Constant, Context, Load, Recorder, ZoneKind};
use blended::Blended;
use drawn::Drawn;
pub use fragments::MOST_AT_ONCE;
use fragments::{FragmentList, FragmentShading};
use gather::{Gather, RowRange};
use resolve::Resolve;
use target::{Band, ImageShape, ImageTarget};
use visibility::{Nearest, Visibility};

/// An image of more bands is timed as one pass, because a recording has a limited number of zones.
const MOST_TIMED_BANDS: usize = 100;

/// The number of rows that are shaded at once is a multiple of this.
const PART_ROWS: u32 = 16;

pub struct ImagePass {
    visibility: Visibility,
    /// The visibility of blended surfaces, if light is gathered for them.
    nearest_blended: Option<Visibility>,
    list: Option<FragmentList>,
    gather: Option<Gather>,
    opaque: Opaque,
    blended: Option<Blended>,
    resolve: Resolve,
    asks: bool,
}

enum Opaque {
    /// Triangle by triangle, as in the talk.
    Drawn(Drawn),
    /// Fragment by fragment.
    Listed(FragmentShading),
}

/// The description from which an [`ImagePass`] is made.
pub struct ImagePassDesc<'a> {
    pub features: Features,
    /// The name of the method whose look-up is used.
    pub method: &'a str,
    /// All constants of the shaders.
    pub constants: Vec<Constant>,
    /// Whether shaders that request light instead of reading it are made too.
    pub asks: bool,
}

impl ImagePassDesc<'_> {
    /// A shader, and its form that requests light. `constants` are those of its own.
    fn light_reader(
        &self,
        context: &Arc<Context>,
        label: &'static str,
        shader: &str,
        constants: &[Constant],
    ) -> Result<LightReader> {
        let constants = with(self.constants.clone(), constants);
        let pass = |shader: &str| Compute::new(context, &ComputeDesc { label, shader, constants: &constants });
        Ok(LightReader { reads: pass(shader)?, asks: self.asks.then(|| pass(&format!("{shader} ASKS"))).transpose()? })
    }
}

/// A shader that reads the light of list items, and its form that requests it, for light on demand.
pub struct LightReader {
    reads: Compute,
    asks: Option<Compute>,
}

impl LightReader {
    fn for_use(&self, light: LightUse) -> &Compute {
        match (light, &self.asks) {
            (LightUse::Asks, Some(asks)) => asks,
            _ => &self.reads,
        }
    }
}

/// How a pass uses the light of list items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightUse {
    Reads,
    /// It requests the light, and writes nothing visible.
    Asks,
}

impl ImagePass {
    /// `counts` are capacities.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, shape: &ImageShape, counts: &Counts) -> Result<Self> {
        let samples = shape.samples_at_once();
        Ok(Self {
            visibility: Visibility::new(context, desc, shape, Nearest::Opaque)?,
            nearest_blended: (shape.gathers.is_some_and(|gathers| gathers.blended))
                .then(|| Visibility::new(context, desc, shape, Nearest::Blended))
                .transpose()?,
            list: shape.lists().then(|| FragmentList::new(context, shape)).transpose()?,
            gather: shape.gathers.map(|gathers| Gather::new(context, desc, shape, gathers)).transpose()?,
            opaque: if shape.drawn {
                Opaque::Drawn(Drawn::new(context, desc, shape)?)
            } else {
                Opaque::Listed(FragmentShading::new(context, desc, shape, Nearest::Opaque, samples)?)
            },
            blended: (desc.features.has(Features::BLEND))
                .then(|| Blended::new(context, desc, shape, counts.blended_samples))
                .transpose()?,
            resolve: Resolve::new(context, desc, shape)?,
            asks: desc.asks,
        })
    }

    /// Grows the buffers for `blended_samples` samples that see blended triangles.
    ///
    /// # Errors
    /// Too little memory.
    pub fn grow(&mut self, context: &Arc<Context>, blended_samples: u32) -> Result<()> {
        self.blended.as_mut().map_or(Ok(()), |blended| blended.grow(context, blended_samples))
    }

    /// Whether it was made to request light.
    pub fn asks(&self) -> bool {
        self.asks
    }

    /// Records the image. `look_up` holds the bindings of the method's look-up. With light on demand, `asked` lights
    /// the items that a band requests.
    pub fn record(&self, r: &mut Recorder, frame: &ImageFrame, look_up: &[Bind<'_>], asked: Option<&dyn OnDemand>) {
        let (target, shape) = (frame.target, frame.target.shape());
        let timed = shape.bands().count() <= MOST_TIMED_BANDS;
        let all = |r: &mut Recorder| {
            for band in shape.bands() {
                let of = BandFrame {
                    frame: *frame,
                    band,
                    rows: RowRange { first: 0, count: band.seen_rows },
                    light: LightUse::Reads,
                };
                let zone = |r: &mut Recorder, name, kind, bytes, record: &dyn Fn(&mut Recorder)| {
                    if timed { r.zone(name, kind, bytes, record) } else { record(r) }
                };
                let row = u64::from(shape.width);
                let seen = row * u64::from(band.seen_rows) * u64::from(shape.samples);
                let written = visibility::SEEN_BYTES * seen * shape.gathered_layers();
                zone(r, "visibility", ZoneKind::Raster, written, &|r| self.see(r, &of));
                let binds = [Nearest::Opaque, Nearest::Blended].map(|of| self.look_up_binds(frame.ground, look_up, of));
                if let Some(asked) = asked {
                    asked.begin(r, frame.ground);
                    let of = BandFrame { light: LightUse::Asks, ..of };
                    zone(r, "ask", ZoneKind::Compute, frame.ground.base().asked_bytes(), &|r| {
                        self.gather(r, &of, look_up);
                        self.shade(r, &of, &binds);
                    });
                    asked.light_asked(r, frame.ground);
                    r.full_barrier(); // the light was written
                }
                if let Some(gather) = &self.gather {
                    zone(r, "gather", ZoneKind::Compute, gather.bytes(&of), &|r| self.gather(r, &of, look_up));
                }
                let bytes = row * u64::from(band.rows) * shape.color_bytes();
                if let Opaque::Drawn(drawn) = &self.opaque {
                    zone(r, "image", ZoneKind::Raster, bytes, &|r| self.draw(r, &of, drawn, &binds[0]));
                    zone(r, "resolve", ZoneKind::Compute, bytes, &|r| self.shade(r, &of, &binds));
                } else {
                    zone(r, "image", ZoneKind::Compute, bytes, &|r| self.shade(r, &of, &binds));
                }
            }
        };
        if timed { all(r) } else { r.zone("image", ZoneKind::Compute, target.bytes(), all) }
    }

    /// Finds the visible triangles of a band.
    fn see(&self, r: &mut Recorder, of: &BandFrame) {
        r.full_barrier(); // the lists were made, and the previous band read the same images
        self.visibility.record(r, of, None);
        if let Some(blended) = &self.nearest_blended {
            blended.record(r, of, Some(&self.visibility));
        }
    }

    fn gather(&self, r: &mut Recorder, of: &BandFrame, look_up: &[Bind<'_>]) {
        let (Some(gather), Some(list)) = (&self.gather, &self.list) else { return };
        // Opaque surfaces come last, because their list is used again.
        let blended = self.nearest_blended.iter().map(|seen| (Nearest::Blended, seen));
        for (nearest, seen) in blended.chain([(Nearest::Opaque, &self.visibility)]) {
            list.record(r, of, seen.bind(of.ground()));
            let mut binds = of.ground().image_binds();
            binds.extend_from_slice(look_up);
            binds.extend(list.binds());
            gather.record(r, of, nearest, binds);
        }
    }

    /// Bindings of the passes that shade surfaces: those of the ground and the method, and the light gathered for these
    /// surfaces.
    fn look_up_binds<'a>(&'a self, ground: &'a Ground, look_up: &[Bind<'a>], of: Nearest) -> Vec<Bind<'a>> {
        let mut binds = ground.image_binds();
        binds.extend_from_slice(look_up);
        binds.extend(self.gather.iter().flat_map(|gather| gather.binds(ground, of)));
        binds
    }

    fn draw(&self, r: &mut Recorder, of: &BandFrame, drawn: &Drawn, binds: &[Bind<'_>]) {
        let mut binds = binds.to_vec();
        binds.push(self.visibility.bind(of.ground()));
        drawn.record(r, of, &self.visibility.target(of, Load::Load), &binds);
    }

    /// Shades and resolves the rows of a band. The recorder may split them into parts.
    fn shade(&self, r: &mut Recorder, of: &BandFrame, binds: &[Vec<Bind<'_>>; 2]) {
        let most = (of.shape().rows_at_once() / of.ground().desc.counts.blended_parts).max(1);
        let before = of.band.first_row - of.band.first_seen;
        r.in_parts(of.band.rows, PART_ROWS, |r, rows| {
            for first in rows.clone().step_by(most as usize) {
                let rows = RowRange { first: before + first, count: most.min(rows.end - first) };
                self.shade_rows(r, &BandFrame { rows, ..*of }, binds);
            }
        });
    }

    /// `binds` are those of the passes that shade opaque and blended fragments.
    fn shade_rows(&self, r: &mut Recorder, of: &BandFrame, [opaque, blending]: &[Vec<Bind<'_>>; 2]) {
        let (ground, texels) = (of.ground(), &of.ground().scene.texel_sampler);
        let mut shown = ground.image_binds();
        r.full_barrier(); // the previous rows were read from the same lists and images
        match &self.opaque {
            Opaque::Drawn(drawn) => shown.extend([drawn.bind(ground), self.visibility.bind(ground)]),
            Opaque::Listed(shading) => {
                let list = self.list.as_ref().expect("fragments are listed where they are shaded");
                // If light is gathered and the rows are not split, the list already has all fragments.
                if self.gather.is_none() || of.rows.count < of.band.seen_rows {
                    list.record(r, of, self.visibility.bind(ground));
                }
                shading.record(r, of, &list.list, opaque);
                shown.push(Bind::images("shaded", shading.shaded(), texels));
                shown.extend(list.binds());
            }
        }
        if let Some(blended) = &self.blended {
            blended.record(r, of, &self.visibility, blending);
            shown.extend(blended.resolve_binds(texels));
        }
        if of.light == LightUse::Reads {
            self.resolve.record(r, of, shown);
        }
    }
}

/// The name of a shader with the requested forms.
fn shader(plain: &str, forms: &[(&str, bool)]) -> String {
    let asked = forms.iter().filter(|(_, asked)| *asked).map(|(form, _)| *form);
    std::iter::once(plain).chain(asked).collect::<Vec<_>>().join(" ")
}

/// A band of an image.
#[derive(Clone, Copy)]
pub struct BandFrame<'a> {
    pub frame: ImageFrame<'a>,
    pub band: Band,
    /// The rows at work, relative to the rows that the band sees.
    pub rows: RowRange,
    pub light: LightUse,
}

impl<'a> BandFrame<'a> {
    pub fn ground(&self) -> &'a Ground {
        self.frame.ground
    }

    pub fn shape(&self) -> &'a ImageShape {
        self.frame.target.shape()
    }

    /// Push constants of the passes that draw or shade it.
    fn push(&self) -> BandPush {
        BandPush { first_row: self.band.first_row, first_seen: self.band.first_seen }
    }
}

/// Inputs of one image: the ground, the target and the scene.
#[derive(Clone, Copy)]
pub struct ImageFrame<'a> {
    pub ground: &'a Ground,
    pub target: &'a ImageTarget,
    pub scene: &'a Scene,
}
