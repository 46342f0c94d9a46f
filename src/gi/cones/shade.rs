//! Passes 2b and 4b, shade: each voxel shades its list into seven values. Layered passes draw one triangle over the
//! screen per slice. Cell passes (`src/ground/cell_passes.rs`) run a thread per list item, then one per occupied voxel.
//! Reads: lists, triangles, materials, lights, lamps; 4b the first bounce's volume. Writes: level 0 of a volume,
//! premultiplied stored radiance. Twin of the fill: `tests/twins/shade.rs`.

use std::sync::Arc;

use super::choices::Passes;
use super::layered;
use crate::Result;
use crate::ground::Ground;
use crate::ground::cell_passes::{FillCells, FillDesc};
use crate::ground::volume::LightVolume;
use crate::vk::{Bind, Context, Raster, Recorder, ZoneKind};

pub enum Shade {
    Layered(Raster, &'static str),
    Cells(FillCells),
}

impl Shade {
    pub fn new(context: &Arc<Context>, passes: Passes, desc: &FillDesc) -> Result<Self> {
        let FillDesc { label, constants, .. } = *desc;
        Ok(match passes {
            Passes::Layered => {
                let fragment = if desc.gathers { "gi/cones/shade.frag LOOK_UP" } else { "gi/cones/shade.frag" };
                Self::Layered(layered(context, label, fragment, constants)?, label)
            }
            Passes::Cells => Self::Cells(FillCells::new(context, desc)?),
        })
    }

    /// `look_up` are bindings in addition to the ground's.
    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, target: &LightVolume, look_up: Vec<Bind<'_>>) {
        let (pipeline, label) = match self {
            Self::Layered(pipeline, label) => (pipeline, *label),
            Self::Cells(fill) => return fill.record(recorder, ground, target, look_up),
        };
        recorder.zone(label, ZoneKind::Raster, target.bytes(0..1), |r| {
            r.full_barrier(); // voxelise wrote the lists, and mips 1 the volume of the look-up
            let mut binds = ground.item_binds(&ground.base().lit_items, &ground.base().item_lights);
            binds.extend(look_up);
            target.draw(r, pipeline, &pipeline.select(&binds), 0);
        });
    }
}
