//! Exact rays that find what the voxels shade, shared among neighbours.
//!
//! Every list item is lit, one for all that are alike, and fills a volume of faces; items then gather from that volume along
//! rays, which fills a second one. The image's rays read the last volume where they hit, by the normal of the triangle hit.

mod settings;

use super::bounces::{BounceDesc, PerBounce};
use super::{Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cell_passes::{EmptyCells, FillCells, FillDesc, MipCells};
use crate::ground::constants::{LAMP_POINTS, LIT, constants, with};
use crate::ground::faces::FaceVolume;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::Settings as AllSettings;
use crate::vk::{Bind, Recorder, SamplerAddressMode};

pub use settings::{KEYS, Settings};

/// Constants of `glsl/gi/rays/constants.glsl`.
const DIFFUSE_RAYS: u32 = 32;
const LOBE_RAYS: u32 = 33;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems), ("mips", PassUnit::Voxels)];

pub struct Lighting {
    shade: PerBounce<FillCells>,
    empty: EmptyCells,
    mips: MipCells,
    /// One per bounce.
    volumes: Vec<FaceVolume>,
    constants: [(u32, u32); 2],
}

impl Gi for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        Wants {
            lists: true,
            rays: true,
            cells: true,
            lit_items: true,
            alike: true,
            kept_direct_light: settings.bounces.volumes() > 1,
            diffuse: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        FaceVolume::plan(settings)
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.rays;
        let voxels = [(DIFFUSE_RAYS, own.bounce), (LAMP_POINTS, settings.lights.voxel_lamp_points), (LIT, 1)];
        let voxels = with(constants(settings, features), &voxels);
        let shade = |BounceDesc { bounce, gathers, direct }| {
            let label = ["shade 1", "shade 2"][bounce];
            let desc = FillDesc { label, folder: "rays", forms: &[""], gathers, direct, constants: &voxels };
            FillCells::new(context, &desc)
        };
        Ok(Self {
            shade: PerBounce::new(settings.bounces, settings.bounces.volumes() > 1, shade)?,
            empty: EmptyCells::new(context, "ground/faces/empty.comp", &voxels)?,
            mips: MipCells::new(context, "rays", &[""], &voxels)?,
            // There is nothing outside of the grid.
            volumes: FaceVolume::per_bounce(context, settings, SamplerAddressMode::CLAMP_TO_BORDER)?,
            constants: [(DIFFUSE_RAYS, own.diffuse), (LOBE_RAYS, own.glossy)],
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        self.shade.each(&self.volumes, update.history, |shade, from, to| {
            // What the last lists filled and these do not is emptied.
            if update.lists {
                self.empty.record(r, ground, to, update.known);
            }
            // Every item is lit, the voxels sum up what their items send,
            shade.record(r, ground, to, from.map_or_else(Vec::new, |volume| volume.binds().collect()));
            // and coarser voxels sum up finer ones, per direction of travel.
            self.mips.record(r, ground, to);
        });
    }

    fn constants(&self) -> &[(u32, u32)] {
        &self.constants
    }

    fn binds(&self) -> Vec<Bind<'_>> {
        self.volumes.last().map_or_else(Vec::new, |volume| volume.binds().collect())
    }

    fn volumes(&self) -> &[FaceVolume] {
        &self.volumes
    }
}
