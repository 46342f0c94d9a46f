//! Passes 2c and 4c, mips: level by level, six directional preintegrations and one plain average.
//! Reads: level k − 1. Writes: level k. Twin: `src/twins/mips.rs`.

use std::sync::Arc;

use super::constants::{Features, constants};
use super::resources::{FACES, Resources, VOLUME_FORMAT, VolumeImages};
use super::{Bounce, layered_target};
use crate::Result;
use crate::settings::Settings;
use crate::vk::{Bind, Context, DrawCall, Raster, RasterDesc, Recorder, ZoneKind};

pub struct Mips {
    pipeline: Raster,
}

impl Mips {
    pub fn new(context: &Arc<Context>, settings: &Settings) -> Result<Self> {
        let pipeline = Raster::new(
            context,
            &RasterDesc {
                label: "mips",
                vertex: "cones/layered.vert",
                fragment: Some("cones/mips.frag"),
                constants: &constants(settings, Features::default(), 0),
                color_formats: &[VOLUME_FORMAT; FACES],
                ..Default::default()
            },
        )?;
        Ok(Self { pipeline })
    }

    pub fn record(&self, recorder: &mut Recorder, bounce: Bounce, resources: &Resources, volume: &VolumeImages) {
        let bytes: u64 = (1..volume.levels).map(|l| 8 * FACES as u64 * u64::from(volume.edge >> l).pow(3)).sum();
        recorder.zone(bounce.pick("mips 1", "mips 2"), ZoneKind::Raster, bytes, |r| {
            const SOURCES: [&str; FACES] =
                ["source_0", "source_1", "source_2", "source_3", "source_4", "source_5", "source_6"];
            for level in 1..volume.levels {
                r.full_barrier(); // the level below was written by shade or by the draw before
                r.raster(&layered_target(&volume.colors(level), volume.edge >> level), |pass| {
                    let binds: Vec<Bind> = SOURCES
                        .iter()
                        .zip(&volume.faces)
                        .map(|(name, face)| Bind::image(name, face.mip_view(level - 1), &resources.volume_sampler))
                        .collect();
                    let call = DrawCall::Direct { vertices: 3, instances: volume.edge >> level };
                    pass.draw(&self.pipeline, &binds, &(), call);
                });
            }
        });
    }
}
