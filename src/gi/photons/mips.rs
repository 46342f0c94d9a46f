//! Mips, level by level, of the parents of occupied cells; and what empties cells that are occupied no more.
//! Reads: level k − 1. Writes: level k. Held by `tests/passes_photons.rs`.

use std::sync::Arc;

use super::volume::PhotonVolume;
use crate::Result;
use crate::ground::Ground;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

/// Workgroups of 64 threads; each goes through many cells, most of which are occupied again.
const EMPTYING_GROUPS: u32 = 16;

pub struct Mips {
    map: Compute,
    opacity: Compute,
}

impl Mips {
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)]) -> Result<Self> {
        let compute = |shader: &str| Compute::new(context, &ComputeDesc { label: "mips", shader, constants });
        Ok(Self { map: compute("gi/photons/mips.comp")?, opacity: compute("gi/photons/mips.comp OPACITY")? })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, volume: &PhotonVolume) {
        recorder.zone(["mips 1", "mips 2"][volume.bounce], ZoneKind::Compute, 0, |r| {
            for level in 1..volume.levels {
                r.full_barrier(); // the level below was written
                let binds: Vec<Bind> = volume.sources(level).chain(volume.targets(level)).collect();
                let cells = &ground.base().cells;
                cells.dispatch(r, &self.map, binds.clone(), (level, volume.edge));
                cells.dispatch(r, &self.opacity, binds, (level, volume.edge));
            }
        });
    }
}

/// Empties what the frame before filled and this one does not. Reads: both frames' cells. Writes: a volume.
pub struct Empty {
    empty: Compute,
}

impl Empty {
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)]) -> Result<Self> {
        let desc = ComputeDesc { label: "empty", shader: "gi/photons/empty.comp", constants };
        Ok(Self { empty: Compute::new(context, &desc)? })
    }

    /// `known`: whether the volume holds what the frame before filled and nothing else; else all of it is emptied.
    pub fn record(&self, r: &mut Recorder, ground: &Ground, volume: &PhotonVolume, known: bool) {
        let lists = ground.base();
        r.zone(["empty 1", "empty 2"][volume.bounce], ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the cells are listed; the volume may have been read
            if !known {
                volume.clear(r);
                return;
            }
            for level in 0..volume.levels {
                let (list, push) = lists.last_cells.level(level, volume.edge);
                let binds = [
                    list,
                    Bind::buffer("cell_counts", &lists.last_cells.counts),
                    Bind::buffer("heads", &lists.heads),
                    Bind::buffer("listed", &lists.listed),
                ];
                let binds: Vec<Bind> = binds.into_iter().chain(volume.targets(level)).collect();
                r.dispatch(&self.empty, &binds, &push, [EMPTYING_GROUPS, 1, 1]);
            }
        });
    }
}
