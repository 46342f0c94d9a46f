//! Resolve: every sample shows the sky, the opaque surface before it, and blended surfaces over both; a pixel the mean of its samples.
//! Reads: what fragments show, lists. Writes: the image, f32.

use std::sync::Arc;

use super::fragments::{GROUP, MOST_GROUPS};
use super::target::ImageShape;
use super::{BandFrame, ImageFrame, ImagePassDesc, shader};
use crate::Result;
use crate::ground::constants::Features;
use crate::ground::layout::ResolvePush;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder};

/// Rows that are resolved at once are multiples of this.
const PART_ROWS: u32 = 16;

pub struct Resolve {
    pass: Compute,
    varied_sky: bool,
}

impl Resolve {
    /// # Errors
    /// A lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, shape: &ImageShape) -> Result<Self> {
        let (layers, samples) = (("AOVS", shape.outputs > 1), ("MULTISAMPLED", shape.samples > 1));
        let forms = [layers, ("DRAWN", shape.drawn), samples, ("BLENDS", desc.features.has(Features::BLEND))];
        let shader = shader("ground/image/resolve.comp", &forms);
        let pass = ComputeDesc { label: "resolve", shader: &shader, constants: &desc.constants };
        Ok(Self {
            pass: Compute::new(context, &pass)?,
            varied_sky: desc.features.has(Features::SKY_GRADIENT) || desc.features.has(Features::SKY_MAP),
        })
    }

    /// `binds`: what the samples of this band show.
    pub fn record<'a>(&self, r: &mut Recorder, of: &BandFrame, frame: &ImageFrame<'a>, mut binds: Vec<Bind<'a>>) {
        let ImageFrame { target, scene, .. } = *frame;
        let (band, width) = (of.band, of.shape.width);
        binds.push(target.bind("resolved"));
        let binds = self.pass.select(&binds);
        let sky = if scene.sky_unseen { [0.0; 3] } else { scene.sky.into() };
        let varied_sky = u32::from(self.varied_sky && !scene.sky_unseen);
        r.in_parts(band.rows, PART_ROWS, |r, rows| {
            let before = band.first_row - band.first_seen;
            let (first, end) = ((before + rows.start) * width, (before + rows.end) * width);
            let push = ResolvePush { sky, varied_sky, first_seen: band.first_seen, width, first, end };
            r.dispatch(&self.pass, &binds, &push, [(end - first).div_ceil(GROUP).min(MOST_GROUPS), 1, 1]);
        });
    }
}
