//! Passes 2c and 4c, mips: level by level, six directional preintegrations and one plain average. Raster form: all cells
//! of a level, one triangle over the screen per slice. Cells form: the parents of occupied cells.
//! Reads: level k − 1. Writes: level k. Twin: `src/twins/mips.rs`.

use std::sync::Arc;

use super::constants::{Features, constants};
use super::resources::{FACES, Resources, VOLUME_FORMAT, VolumeImages};
use super::{Bounce, Form, face_binds, layered_target};
use crate::Result;
use crate::settings::{Settings, Work};
use crate::vk::{Bind, Compute, ComputeDesc, Context, DrawCall, Raster, RasterDesc, Recorder};

pub struct Mips {
    form: Form,
}

impl Mips {
    pub fn new(context: &Arc<Context>, settings: &Settings) -> Result<Self> {
        let constants = constants(settings, Features::default(), 0);
        let form = match settings.mips {
            Work::Raster => Form::Raster(Raster::new(
                context,
                &RasterDesc {
                    label: "mips",
                    vertex: "cones/layered.vert",
                    fragment: Some("cones/mips.frag"),
                    constants: &constants,
                    color_formats: &[VOLUME_FORMAT; FACES],
                    ..Default::default()
                },
            )?),
            Work::Cells => {
                let desc = ComputeDesc { label: "mips", shader: "cones/mips.comp", constants: &constants };
                Form::Cells(Compute::new(context, &desc)?)
            }
        };
        Ok(Self { form })
    }

    pub fn record(&self, recorder: &mut Recorder, bounce: Bounce, resources: &Resources, volume: &VolumeImages) {
        let whole: u64 = (1..volume.levels).map(|l| 8 * FACES as u64 * u64::from(volume.edge >> l).pow(3)).sum();
        let bytes = self.form.bytes(whole);
        recorder.zone(bounce.pick("mips 1", "mips 2"), self.form.kind(), bytes, |r| {
            const SOURCES: [&str; FACES] =
                ["source_0", "source_1", "source_2", "source_3", "source_4", "source_5", "source_6"];
            for level in 1..volume.levels {
                r.full_barrier(); // the level below was written by shade or just before
                let mut binds: Vec<Bind> = SOURCES
                    .iter()
                    .zip(&volume.faces)
                    .map(|(name, face)| Bind::image(name, face.mip_view(level - 1), &resources.volume_sampler))
                    .collect();
                match &self.form {
                    Form::Raster(pipeline) => {
                        r.raster(&layered_target(&volume.colors(level), volume.edge >> level), |pass| {
                            let call = DrawCall::Direct { vertices: 3, instances: volume.edge >> level };
                            pass.draw(pipeline, &binds, &(), call);
                        });
                    }
                    Form::Cells(pipeline) => {
                        binds.extend(face_binds(volume, level));
                        resources.cells.dispatch(r, pipeline, binds, (level, volume.edge));
                    }
                }
            }
        });
    }
}
