//! An example of a method: constant indirect light. `tests/command/new_method.rs` adds it to a copy of the source.

use super::{IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::grid::GridPlace;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::Settings;
use crate::vk::{Bind, Buffer, BufferKind, Constant, Recorder, ZoneKind};

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("constant", PassUnit::Voxels)];

/// A pass of its own writes the light into a buffer of its own.
pub struct Lighting {
    light: Buffer,
    radiance: f32,
}

impl IndirectMethod for Lighting {
    fn wants(settings: &Settings) -> Wants {
        // Coarser lists of its own, over the same cube.
        let voxel = settings.voxels as f32 / 8.0;
        Wants { grids: vec![GridPlace { edge: 8, corner: [0.0; 3], voxel }], diffuse: true, ..Wants::default() }
    }

    fn plan(_: &Settings) -> Vec<MemoryRow> {
        vec![("constant light", 16)]
    }

    fn new(maker: &Maker) -> Result<Self> {
        let light = Buffer::new(maker.context, "constant light", 16, BufferKind::Device)?;
        Ok(Self { light, radiance: maker.settings.of.constant.radiance })
    }

    fn update(&self, recorder: &mut Recorder, ground: &Ground, _: &Update) {
        assert_eq!(ground.lists[1].place.edge, 8);
        recorder.zone("constant", ZoneKind::Transfer, 16, |r| {
            r.full_barrier(); // the frame before read the light
            r.fill(&self.light, 0, 16, self.radiance.to_bits());
        });
    }

    fn constants(&self) -> &[Constant] {
        &[]
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        vec![Bind::buffer("constant_light", &self.light)]
    }
}
