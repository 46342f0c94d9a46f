//! Passes that fill a volume from lit list items, by lists of occupied cells, and that empty it again. Methods differ
//! in the volume and in the shaders, which are in the folder of the method.

use super::cells::LIT_COUNTS;
use std::sync::Arc;

use super::Ground;
use super::constants::with;
use super::volume::LightVolume;
use crate::Result;
use crate::vk::{Bind, Compute, ComputeDesc, Constant, Context, Recorder, ZoneKind};

/// Workgroups of 64 threads. Each visits many cells, most of which are occupied again.
const EMPTYING_GROUPS: u32 = 16;

/// Empties voxels that the previous frame filled and this one does not. Reads: cells of both frames. Writes: a volume.
pub struct EmptyCells {
    empty: Compute,
}

impl EmptyCells {
    pub fn new(context: &Arc<Context>, shader: &str, constants: &[Constant]) -> Result<Self> {
        Ok(Self { empty: Compute::new(context, &ComputeDesc { label: "empty", shader, constants })? })
    }

    /// `known` says whether the volume holds only voxels that the previous frame filled; otherwise all of it is
    /// emptied.
    pub fn record(&self, r: &mut Recorder, ground: &Ground, volume: &LightVolume, known: bool) {
        let lists = ground.base();
        r.zone(["empty 1", "empty 2"][volume.bounce], ZoneKind::Compute, volume.bytes(0..volume.levels), |r| {
            r.full_barrier(); // the cells are listed; the volume may have been read
            if !known {
                volume.images.iter().for_each(|image| r.clear(image));
                return;
            }
            for level in 0..volume.levels {
                let (list, push) = lists.last_cells.level(level);
                let mut binds = vec![
                    list,
                    Bind::buffer("cell_counts", &lists.last_cells.counts),
                    Bind::buffer("heads", &lists.heads),
                    Bind::buffer("listed", &lists.listed),
                ];
                binds.extend(volume.targets(level));
                r.dispatch(&self.empty, &binds, &push, [EMPTYING_GROUPS, 1, 1]);
            }
        });
    }
}

/// Lights the items of the lists, then fills the occupied voxels. Reads: lists, triangles, materials, lights, lamps,
/// kept direct light, and bindings of the look-up. Writes: item lights, kept direct light, level 0 of a volume.
pub struct FillCells {
    light: Compute,
    fills: Vec<Compute>,
    label: &'static str,
}

/// Shaders and constants of the passes that shade voxels.
#[derive(Clone, Copy)]
pub struct FillDesc<'a> {
    pub label: &'static str,
    /// The method's folder with `light.comp` and `fill.comp`.
    pub folder: &'a str,
    /// Forms of `fill.comp`, each of which fills a part of the volume: `""`, or a space and a macro.
    pub forms: &'a [&'a str],
    /// Whether light of an earlier bounce is looked up.
    pub gathers: bool,
    /// The value of the constant `DIRECT`.
    pub direct: u32,
    pub constants: &'a [Constant],
}

impl FillCells {
    pub fn new(context: &Arc<Context>, desc: &FillDesc) -> Result<Self> {
        let FillDesc { label, folder, .. } = *desc;
        let constants = with(desc.constants.to_vec(), &[("DIRECT", desc.direct.into())]);
        let compute = |shader: &str| Compute::new(context, &ComputeDesc { label, shader, constants: &constants });
        let gathers = if desc.gathers { " LOOK_UP" } else { "" };
        let fill = |form: &&str| compute(&format!("gi/{folder}/fill.comp{form}"));
        Ok(Self {
            light: compute(&format!("gi/{folder}/light.comp{gathers}"))?,
            fills: desc.forms.iter().map(fill).collect::<Result<_>>()?,
            label,
        })
    }

    /// `look_up` holds the bindings of the method's look-up.
    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, target: &LightVolume, look_up: Vec<Bind<'_>>) {
        let lists = ground.base();
        let bytes = lists.item_lights.bytes() + target.bytes(0..1);
        recorder.zone(self.label, ZoneKind::Compute, bytes, |r| {
            r.full_barrier(); // the lists and the volume that is gathered from were written
            let mut binds = ground.item_binds(&ground.base().lit_items, &ground.base().item_lights);
            binds.extend(look_up);
            lists.cells.light_items(r, &self.light, binds.clone(), LIT_COUNTS);
            r.full_barrier(); // the items are lit
            binds.extend(target.targets(0));
            for fill in &self.fills {
                lists.cells.dispatch(r, fill, binds.clone(), 0);
            }
        });
    }
}

/// Mips of the parents of occupied cells, level by level. Reads: level k − 1. Writes: level k.
pub struct MipCells {
    mips: Vec<Compute>,
}

impl MipCells {
    /// `folder` is that of the method's `mips.comp`; `forms` are as in [`FillDesc`].
    pub fn new(context: &Arc<Context>, folder: &str, forms: &[&str], constants: &[Constant]) -> Result<Self> {
        let mips = |form: &&str| {
            let shader = format!("gi/{folder}/mips.comp{form}");
            Compute::new(context, &ComputeDesc { label: "mips", shader: &shader, constants })
        };
        Ok(Self { mips: forms.iter().map(mips).collect::<Result<_>>()? })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, volume: &LightVolume) {
        recorder.zone(volume.mips_zone(), ZoneKind::Compute, volume.bytes(1..volume.levels), |r| {
            for level in 1..volume.levels {
                r.full_barrier(); // the level below was written
                let mut binds = volume.sources(level);
                binds.extend(volume.targets(level));
                for mips in &self.mips {
                    ground.base().cells.dispatch(r, mips, binds.clone(), level);
                }
                r.end_step();
            }
        });
    }
}
