//! Voxel cone tracing with two bounces, mirroring the talk's pipeline: one file per pass.
//!
//! The talk: BeRo and urs, "How to use Voxel Cone Tracing with two bounces for everything instead of just Global
//! Illumination" (listings CC0).

pub mod choices;
pub mod constants;
pub mod ledger;
mod mips;
mod settings;
mod shade;

use super::{Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::{DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ, LAMP_POINTS, SHADOWS, SHADOWS_NONE, with};
use crate::ground::faces::{EmptyFaces, FACES, FaceVolume, FillDesc};
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, LampLight, Settings as AllSettings, Shadows};
use crate::vk::{self, Bind, Buffer, ColorTarget, Recorder, RenderTarget};
use choices::{Form, Passes};
use mips::Mips;
use shade::Shade;

pub use settings::{KEYS, Ledger, Settings, Start};

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems), ("mips", PassUnit::Voxels)];

pub struct Lighting {
    first: Shade,
    /// The first bounce with the last frame's light to gather from; absent unless `bounces = all`.
    again: Option<Shade>,
    second: Option<Shade>,
    /// Absent in layered passes, which write every voxel.
    empty: Option<EmptyFaces>,
    mips: Mips,
    /// Whether the second bounce voxelises again.
    relists: bool,
    /// One per bounce.
    volumes: Vec<FaceVolume>,
    /// The uniform block.
    block: Buffer,
    constants: [(u32, u32); 8],
}

impl Gi for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let own = &settings.of.cones;
        let cells = own.passes == Passes::Cells;
        Wants {
            lists: true,
            dilated: own.ledger.d30 == Form::Printed,
            rays: settings.lights.shadows == Shadows::Rays || settings.lights.lamps == LampLight::Sampled,
            cells,
            lit_items: cells,
            kept_direct_light: keeps_direct_light(settings),
            diffuse: true,
            shadows: true,
            unsteady: own.jitter || own.shadow_jitter && settings.lights.shadows == Shadows::Method,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        let mut rows = vec![("cones", size_of::<constants::Cones>() as u64)];
        rows.extend(FaceVolume::plan(settings));
        rows
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.cones;
        let constants = constants::constants(own);
        let voxels = with(crate::ground::constants::constants(settings, features), &constants);
        let voxels = with(voxels, &[(LAMP_POINTS, settings.lights.voxel_lamp_points)]);
        // The talk's first bounce has no volume that could shadow it.
        let unshadowed = with(voxels.clone(), &[(SHADOWS, SHADOWS_NONE)]);
        let plain = if own.first_bounce_shadows { &voxels } else { &unshadowed };
        let (kept, read) =
            if keeps_direct_light(settings) { (DIRECT_KEPT, DIRECT_READ) } else { (DIRECT_FOUND, DIRECT_FOUND) };
        let shade = |label, gathers, constants: &Vec<_>, direct| {
            Shade::new(context, own.passes, &FillDesc { label, folder: "cones", gathers, direct, constants })
        };
        let two = settings.bounces.volumes() > 1;
        Ok(Self {
            first: shade("shade 1", false, plain, kept)?,
            again: (settings.bounces == Bounces::All).then(|| shade("shade 1", true, &voxels, kept)).transpose()?,
            second: two.then(|| shade("shade 2", true, &voxels, read)).transpose()?,
            empty: (own.passes == Passes::Cells).then(|| EmptyFaces::new(context, &voxels)).transpose()?,
            mips: Mips::new(context, own.passes, &voxels)?,
            relists: own.passes == Passes::Layered,
            volumes: FaceVolume::per_bounce(context, settings, own.address_mode())?,
            block: vk::upload(context, "cones", &[constants::Cones::new(own, settings.voxels)])?,
            constants,
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        let [first, rest @ ..] = &self.volumes[..] else { return };
        // What the last lists filled and these do not is emptied.
        let empty = |r: &mut Recorder, volume| match &self.empty {
            Some(empty) if update.lists => empty.record(r, ground, volume, update.known),
            _ => (),
        };
        empty(r, first);
        match (&self.again, rest) {
            // 2b. Every voxel shades its list with direct light and, with all bounces, what the last frame left,
            (Some(again), [second]) if update.history => again.record(r, ground, first, self.look_up(second)),
            // or with direct light alone,
            _ => self.first.record(r, ground, first, vec![Bind::buffer("cones", &self.block)]),
        }
        // 2c. and coarser voxels sum it up, per direction of travel.
        self.mips.record(r, ground, first);
        if let (Some(shade), [second]) = (&self.second, rest) {
            if self.relists && update.lists {
                // 3, 4a. The lists are made once more; the triangles stay.
                ground.relist(r);
            }
            empty(r, second);
            // 4b. Every voxel shades its list with direct light and cones into the first bounce,
            shade.record(r, ground, second, self.look_up(first));
            // 4c. and coarser voxels sum it up.
            self.mips.record(r, ground, second);
        }
    }

    fn constants(&self) -> &[(u32, u32)] {
        &self.constants
    }

    fn binds(&self) -> Vec<Bind<'_>> {
        self.volumes.last().map_or_else(Vec::new, |volume| self.look_up(volume))
    }

    fn volumes(&self) -> &[FaceVolume] {
        &self.volumes
    }
}

impl Lighting {
    /// A volume to be looked up.
    fn look_up<'a>(&'a self, volume: &'a FaceVolume) -> Vec<Bind<'a>> {
        let mut binds: Vec<Bind> = volume.binds().collect();
        binds.push(Bind::buffer("cones", &self.block));
        binds
    }
}

/// Whether the second bounce takes over the first one's direct light: only where both would find the same.
fn keeps_direct_light(settings: &AllSettings) -> bool {
    let own = &settings.of.cones;
    let same = match settings.lights.shadows {
        Shadows::None => true,
        Shadows::Rays => own.first_bounce_shadows,
        Shadows::Method => false,
    };
    own.passes == Passes::Cells && settings.bounces.volumes() > 1 && same
}

/// `edge` slices of `edge`² texels.
fn layered_target<'a>(colors: &'a [ColorTarget<'a>; FACES], edge: u32) -> RenderTarget<'a> {
    RenderTarget { colors, width: edge, height: edge, layers: edge, ..Default::default() }
}
