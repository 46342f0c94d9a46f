//! Resolve: every sample shows the sky, the opaque surface in front of it, and blended surfaces over both; a pixel
//! shows the mean of its samples. Reads: shaded fragments, lists. Writes: the image, f32.

use std::sync::Arc;

use super::fragments::GROUP;
use super::target::ImageShape;
use super::{BandFrame, ImagePassDesc, shader};
use crate::Result;
use crate::ground::constants::Features;
use crate::ground::layout::ResolvePush;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder};

pub struct Resolve {
    pass: Compute,
    varied_sky: bool,
}

impl Resolve {
    /// # Errors
    /// The device is lost.
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

    /// `binds` hold the shaded samples.
    pub fn record<'a>(&self, r: &mut Recorder, of: &BandFrame<'a>, mut binds: Vec<Bind<'a>>) {
        let (target, scene, width) = (of.frame.target, of.frame.scene, of.shape().width);
        binds.push(target.bind("resolved"));
        let sky = if scene.sky_unseen { [0.0; 3] } else { scene.sky.into() };
        let varied_sky = u32::from(self.varied_sky && !scene.sky_unseen);
        let push = ResolvePush { sky, varied_sky, first_seen: of.band.first_seen, first: of.rows.first };
        r.dispatch(&self.pass, &self.pass.select(&binds), &push, [width.div_ceil(GROUP), of.rows.count, 1]);
    }
}
