//! Fill: lights the lists' items, then sums up what the photons of every occupied voxel send, and how much they stand in the way.
//! Reads: lists, item samples, triangles, materials, lights, and what a look-up binds. Writes: item lights, level 0 of a volume.
//! Held by `tests/passes_photons.rs`.

use std::sync::Arc;

use super::volume::PhotonVolume;
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::{DIRECT, with};
use crate::ground::faces::FillDesc;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

pub struct Fill {
    light: Compute,
    map: Compute,
    opacity: Compute,
    label: &'static str,
}

impl Fill {
    pub fn new(context: &Arc<Context>, desc: &FillDesc) -> Result<Self> {
        let FillDesc { label, .. } = *desc;
        let constants = with(desc.constants.to_vec(), &[(DIRECT, desc.direct)]);
        let compute = |shader: &str| Compute::new(context, &ComputeDesc { label, shader, constants: &constants });
        Ok(Self {
            light: compute(if desc.gathers { "gi/photons/light.comp LOOK_UP" } else { "gi/photons/light.comp" })?,
            map: compute("gi/photons/fill.comp")?,
            opacity: compute("gi/photons/fill.comp OPACITY")?,
            label,
        })
    }

    /// `look_up`: what the look-up binds.
    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, target: &PhotonVolume, look_up: Vec<Bind<'_>>) {
        let lists = ground.base();
        recorder.zone(self.label, ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the lists, their samples and the volume that is gathered from were written
            let mut binds = ground.item_binds();
            binds.extend(look_up);
            lists.cells.dispatch_items(r, &self.light, binds.clone());
            r.full_barrier(); // the items are lit
            binds.extend(target.targets(0));
            lists.cells.dispatch(r, &self.map, binds.clone(), (0, target.edge));
            lists.cells.dispatch(r, &self.opacity, binds, (0, target.edge));
        });
    }
}
