//! Pass 2a, alike: of a voxel's triangles that have one material and face alike, the largest is lit for all.
//! Reads: lists, triangles, materials. Writes: item parts, lit items and their count. Twin: `src/twins/alike.rs`.

use std::sync::Arc;

use super::constants::{Features, constants};
use super::resources::Resources;
use super::shading_binds;
use crate::Result;
use crate::gpu_scene::GpuScene;
use crate::settings::Settings;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

pub struct Alike {
    choose: Compute,
    edge: u32,
}

impl Alike {
    pub fn new(context: &Arc<Context>, settings: &Settings) -> Result<Self> {
        let constants = constants(settings, Features::default(), 0);
        let desc = ComputeDesc { label: "alike", shader: "cones/alike.comp", constants: &constants };
        Ok(Self { choose: Compute::new(context, &desc)?, edge: settings.voxels })
    }

    pub fn record(&self, recorder: &mut Recorder, scene: &GpuScene, resources: &Resources) {
        recorder.zone("alike", ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the voxels are listed and counted, nothing is lit yet
            let mut binds = shading_binds(scene, resources);
            binds.push(Bind::buffer("item_parts", &resources.item_parts));
            binds.push(Bind::buffer("lit_items", &resources.lit_items));
            resources.cells.dispatch(r, &self.choose, binds, (0, self.edge));
        });
    }
}
