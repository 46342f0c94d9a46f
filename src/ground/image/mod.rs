//! The image: which triangle every sample sees first, then of each triangle in a pixel the samples' direct light and, once, what the
//! method looks up; blended triangles over it, back to front. In bands of rows, so that multisampled targets stay small.
//! Diffuse light may be gathered before, apart from the image.
//! Reads: triangles, lists, the method's light. Writes: radiance, f32.

pub mod fragments;
pub mod gather;
pub mod given;
pub mod target;
pub mod visibility;

use std::sync::Arc;

use super::Ground;
use super::constants::{Features, with};
use super::layout::BandPush;
use crate::Result;
use crate::scene::Scene;
use crate::settings::ImageSettings;
use crate::vk::{
    Bind, CompareOp, Constant, Context, DepthDesc, DrawCall, Raster, RasterDesc, Recorder, Rect, RenderTarget, ZoneKind,
};
use fragments::{Fragments, FragmentsFrame, Part};
use gather::Gather;
use target::{Band, COLOR_FORMAT, DEPTH_FORMAT, ImageTarget};
use visibility::{Visibility, VisibilityDesc};

/// An image of more bands than this is timed as one pass: a recording has room for so many zones only.
const MOST_TIMED_BANDS: usize = 100;
/// Rows that are shaded at once are multiples of this.
const PART_ROWS: u32 = 16;

pub struct ImagePass {
    visibility: Visibility,
    opaque: Opaque,
    blended: Option<Raster>,
    sky: Option<Raster>,
    gather: Option<Gather>,
}

enum Opaque {
    Drawn(Raster),
    Packed(Fragments),
}

/// What an [`ImagePass`] is made for.
pub struct ImagePassDesc<'a> {
    pub settings: &'a ImageSettings,
    pub features: Features,
    /// The method's name: its look-up is asked.
    pub method: &'a str,
    /// Whether its diffuse look-up is gathered apart,
    pub apart: bool,
    /// and what it finds for rough lobes beside it.
    pub lobes: bool,
    /// All constants of the shaders.
    pub constants: Vec<Constant>,
}

impl ImagePass {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, target: &ImageTarget) -> Result<Self> {
        let ImagePassDesc { settings, features, method, apart, ref constants, .. } = *desc;
        let layers = if target.outputs() > 1 { " AOVS" } else { "" };
        let apart_form = if apart { " GATHERED" } else { "" };
        let shader = |file: &str, form: &str| format!("ground/image/{file} {method}{form}{layers}");
        let (packed, drawn) = (shader("image.frag", apart_form), shader("drawn.frag", apart_form));
        let blended_fragment = shader("drawn.frag", ""); // what lies behind was gathered, not these
        let formats = vec![COLOR_FORMAT; target.outputs()];
        let depth = |compare, write| Some(DepthDesc { format: DEPTH_FORMAT, compare, write });
        let common = RasterDesc {
            label: "image",
            vertex: "ground/image/image.vert",
            samples: settings.samples,
            constants,
            color_formats: &formats,
            ..Default::default()
        };
        let drawn = RasterDesc { fragment: Some(&drawn), depth: depth(CompareOp::EQUAL, false), ..common };
        let opaque = if target.shape().packed {
            Opaque::Packed(Fragments::new(context, desc, target, &packed)?)
        } else {
            Opaque::Drawn(Raster::new(context, &drawn)?)
        };
        let (width, height) = (target.width, target.shape().band_rows());
        let seen = VisibilityDesc { gathered: false, width, height, samples: settings.samples };
        let with_blending = with(constants.clone(), &[("BLENDED", 1u32.into())]);
        let blended = RasterDesc {
            label: "image blended",
            fragment: Some(&blended_fragment),
            constants: &with_blending,
            depth: depth(CompareOp::GREATER_OR_EQUAL, false),
            blends: true,
            ..common
        };
        let sky = RasterDesc {
            label: "sky",
            vertex: "ground/image/sky.vert",
            fragment: Some(if layers.is_empty() { "ground/image/sky.frag" } else { "ground/image/sky.frag AOVS" }),
            depth: depth(CompareOp::EQUAL, false),
            ..common
        };
        Ok(Self {
            sky: (features.has(Features::SKY_GRADIENT) || features.has(Features::SKY_MAP))
                .then(|| Raster::new(context, &sky))
                .transpose()?,
            visibility: Visibility::new(context, desc, &seen)?,
            opaque,
            blended: features.has(Features::BLEND).then(|| Raster::new(context, &blended)).transpose()?,
            gather: apart.then(|| Gather::new(context, desc, target)).transpose()?,
        })
    }

    /// `look_up`: what the method's look-up binds.
    pub fn record(&self, r: &mut Recorder, frame: &ImageFrame, look_up: &[Bind<'_>]) {
        let target = frame.target;
        if target.bands().count() > MOST_TIMED_BANDS {
            r.zone("image", ZoneKind::Raster, target.bytes(), |r| {
                for band in target.bands() {
                    if let Some(gather) = &self.gather {
                        gather.record(r, frame.ground, look_up, &band);
                    }
                    self.draw_band(r, frame, look_up, &band);
                }
            });
            return;
        }
        for band in target.bands() {
            if let Some(gather) = &self.gather {
                r.zone("gather", ZoneKind::Raster, gather.bytes(&band), |r| {
                    gather.record(r, frame.ground, look_up, &band)
                });
            }
            let bytes = target.bytes() / u64::from(target.height) * u64::from(band.rows);
            r.zone("image", ZoneKind::Raster, bytes, |r| self.draw_band(r, frame, look_up, &band));
        }
    }

    fn draw_band(&self, r: &mut Recorder, frame: &ImageFrame, look_up: &[Bind<'_>], band: &Band) {
        let ImageFrame { ground, target, blended, scene } = *frame;
        let sky = if scene.sky_unseen { [0.0; 3] } else { scene.sky.into() };
        r.full_barrier(); // the method wrote its light, gather and share theirs; the band before was copied from the same targets
        let mut binds = ground.image_binds();
        binds.extend_from_slice(look_up);
        if let Some(gather) = &self.gather {
            binds.extend(gather.binds(ground));
        }
        let push = BandPush { first_row: band.first_row };
        self.visibility.record(r, ground, &target.render_target(&[], band), band.first_row);
        r.in_parts(band.rows, PART_ROWS, |r, rows| {
            let part = Part { band, first_row: rows.start, rows: rows.len() as u32 };
            if let Opaque::Packed(fragments) = &self.opaque {
                let frame = FragmentsFrame { target, seen: self.visibility.bind(ground), binds: &binds };
                fragments.shade(r, &frame, &part);
            }
            let area = Rect { x: 0, y: part.first_row as i32, width: target.width, height: part.rows };
            let colors = target.colors(sky);
            let whole = target.render_target(&colors, band);
            r.raster(&RenderTarget { area: Some(area), ..whole }, |pass| {
                match &self.opaque {
                    Opaque::Drawn(drawn) => pass.draw(drawn, &drawn.select(&binds), &push, ground.recorded()),
                    Opaque::Packed(fragments) => fragments.spread(pass, ground, target),
                }
                if let Some(pipeline) = self.sky.as_ref().filter(|_| !scene.sky_unseen) {
                    let call = DrawCall::Direct { vertices: 3, instances: 1 };
                    pass.draw(pipeline, &pipeline.select(&binds), &(), call);
                }
                if let Some(pipeline) = &self.blended {
                    let call = DrawCall::Direct { vertices: 3 * blended, instances: 1 };
                    pass.draw(pipeline, &pipeline.select(&binds), &push, call);
                }
            });
        });
        target.copy_band(r, band);
    }
}

/// What an image is made of.
#[derive(Clone, Copy)]
pub struct ImageFrame<'a> {
    pub ground: &'a Ground,
    pub target: &'a ImageTarget,
    /// Blended triangles.
    pub blended: u32,
    pub scene: &'a Scene,
}
