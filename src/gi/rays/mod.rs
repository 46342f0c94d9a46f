//! Exact rays that find what the voxels shade, shared among neighbours.
//!
//! Every list item is lit, one for all that are alike, and fills a volume of faces; items then gather from that volume along
//! rays, which fills a second one. The image's rays read the last volume where they hit, by the normal of the triangle hit.

mod settings;

use super::{Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::{DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ, LAMP_POINTS, LIT, constants, with};
use crate::ground::faces::{EmptyFaces, FaceVolume, FillDesc, FillFaces, MipFaces};
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Recorder, SamplerAddressMode};

pub use settings::{KEYS, Settings};

/// Constants of `glsl/gi/rays/constants.glsl`.
const DIFFUSE_RAYS: u32 = 32;
const LOBE_RAYS: u32 = 33;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems), ("mips", PassUnit::Voxels)];

pub struct Lighting {
    first: FillFaces,
    /// The first bounce with the last frame's light to gather from; absent unless `bounces = all`.
    again: Option<FillFaces>,
    second: Option<FillFaces>,
    empty: EmptyFaces,
    mips: MipFaces,
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
        let fill = |label, gathers, direct| {
            FillFaces::new(context, &FillDesc { label, folder: "rays", gathers, direct, constants: &voxels })
        };
        let two = settings.bounces.volumes() > 1;
        let direct = if two { DIRECT_KEPT } else { DIRECT_FOUND };
        Ok(Self {
            first: fill("shade 1", false, direct)?,
            again: (settings.bounces == Bounces::All).then(|| fill("shade 1", true, direct)).transpose()?,
            second: two.then(|| fill("shade 2", true, DIRECT_READ)).transpose()?,
            empty: EmptyFaces::new(context, &voxels)?,
            mips: MipFaces::new(context, "rays", &voxels)?,
            // There is nothing outside of the grid.
            volumes: FaceVolume::per_bounce(context, settings, SamplerAddressMode::CLAMP_TO_BORDER)?,
            constants: [(DIFFUSE_RAYS, own.diffuse), (LOBE_RAYS, own.glossy)],
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        let [first, rest @ ..] = &self.volumes[..] else { return };
        // What the last lists filled and these do not is emptied.
        if update.lists {
            self.empty.record(r, ground, first, update.known);
        }
        match (&self.again, rest) {
            // Every item is lit directly and, with all bounces, by what the last frame left,
            (Some(again), [second]) if update.history => again.record(r, ground, first, second.binds().collect()),
            // or directly alone; the voxels sum up what their items send,
            _ => self.first.record(r, ground, first, Vec::new()),
        }
        // and coarser voxels sum up finer ones, per direction of travel.
        self.mips.record(r, ground, first);
        if let (Some(light), [second]) = (&self.second, rest) {
            if update.lists {
                self.empty.record(r, ground, second, update.known);
            }
            // Every item is lit once more, with what it gathers from the first bounce.
            light.record(r, ground, second, first.binds().collect());
            self.mips.record(r, ground, second);
        }
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
