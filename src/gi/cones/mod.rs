//! Voxel cone tracing with two bounces, mirroring the talk's pipeline: one file per pass.
//!
//! The talk: BeRo and urs, "How to use Voxel Cone Tracing with two bounces for everything instead of just Global
//! Illumination" (listings CC0).

pub mod constants;
mod mips;
mod shade;

use std::sync::Arc;

use super::bounces::{BounceDesc, PerBounce};
use super::{IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cell_passes::{EmptyCells, FillDesc};
use crate::ground::constants::with;
use crate::ground::memory_plan::MemoryRow;
use crate::ground::volume::{FACE_VOLUME, FACES, FORMAT, LightVolume, VolumeKind};
use crate::settings::{LampLight, Settings as AllSettings, Shadows};
use crate::vk::{self, Bind, Buffer, Constant, Context, Raster, RasterDesc, Recorder};
use choices::{Form, Passes};
use mips::Mips;
use shade::Shade;

pub use crate::settings::methods::cones::{Ledger, Settings, Start, choices};

pub const PASS_UNITS: &[(&str, PassUnit)] = &[("shade", PassUnit::WalkedItems), ("mips", PassUnit::Voxels)];

pub struct Lighting {
    shade: PerBounce<Shade>,
    /// `None` for layered passes, which write every voxel.
    empty: Option<EmptyCells>,
    mips: Mips,
    /// Whether the second bounce voxelises again.
    relists: bool,
    /// One volume per bounce.
    volumes: Vec<LightVolume>,
    /// The uniform block.
    block: Buffer,
    constants: [Constant; 8],
}

impl IndirectMethod for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let own = &settings.of.cones;
        let cells = own.passes == Passes::Cells;
        Wants {
            lists: true,
            dilated: own.ledger.d30 == Form::Printed,
            rays: settings.lights.shadows == Shadows::Rays || settings.lights.lamps == LampLight::Sampled,
            cells,
            last_cells: cells,
            lit_items: cells,
            kept_direct_light: keeps_direct_light(settings),
            diffuse: true,
            drawn: !cells,
            shadows: true,
            turns: own.jitter || own.shadow_jitter && settings.lights.shadows == Shadows::Method,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        let mut rows = vec![("cones", size_of::<constants::Cones>() as u64)];
        rows.extend(LightVolume::plan(&FACE_VOLUME, settings));
        rows
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.cones;
        let constants = constants::constants(own);
        let voxels = with(crate::ground::constants::constants(settings, features), &constants);
        let voxels = with(voxels, &[("LAMP_POINTS", settings.lights.voxel_lamp_points.into())]);
        // The talk's first bounce has no volume for shadow cones.
        let unshadowed = with(voxels.clone(), &[("SHADOWS", Shadows::None.into())]);
        let plain = if own.first_bounce_shadows { &voxels } else { &unshadowed };
        let shade = |BounceDesc { bounce, gathers, direct }| {
            let (label, constants) = (["shade 1", "shade 2"][bounce], if gathers { &voxels } else { plain });
            let desc = FillDesc { label, folder: "cones", forms: &[""], gathers, direct, constants };
            Shade::new(context, own.passes, &desc)
        };
        let kind = VolumeKind { outside: own.address_mode(), ..FACE_VOLUME };
        Ok(Self {
            shade: PerBounce::new(settings.bounces, keeps_direct_light(settings), shade)?,
            empty: (own.passes == Passes::Cells).then(|| EmptyCells::new(context, "ground/faces/empty.comp", &voxels)).transpose()?,
            mips: Mips::new(context, own.passes, &voxels)?,
            relists: own.passes == Passes::Layered,
            volumes: LightVolume::per_bounce(context, kind, settings)?,
            block: vk::upload(context, "cones", &[constants::Cones::new(own, settings.voxels)])?,
            constants,
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        self.shade.each(&self.volumes, update.history, |shade, from, to| {
            if self.relists && update.lists && to.bounce == 1 {
                // Passes 3 and 4a: the lists are made again, and the triangles stay.
                ground.relist(r);
            }
            // Voxels that only the previous lists filled are emptied.
            if let (Some(empty), true) = (&self.empty, update.lists) {
                empty.record(r, ground, to, update.known);
            }
            // Passes 2b and 4b: every voxel shades its list with direct light, and with cones through the volume of the
            // previous bounce.
            let block = || vec![Bind::buffer("cones", &self.block)];
            shade.record(r, ground, to, from.map_or_else(block, |volume| self.look_up(volume)));
            // Passes 2c and 4c: coarser voxels average finer ones, for each direction of travel.
            self.mips.record(r, ground, to);
        });
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        self.volumes.last().map_or_else(Vec::new, |volume| self.look_up(volume))
    }

    fn volumes(&self) -> &[LightVolume] {
        &self.volumes
    }
}

impl Lighting {
    /// Bindings of a volume for look-ups.
    fn look_up<'a>(&'a self, volume: &'a LightVolume) -> Vec<Bind<'a>> {
        let mut binds: Vec<Bind> = volume.binds().collect();
        binds.push(Bind::buffer("cones", &self.block));
        binds
    }
}

/// Whether the second bounce reuses the first one's direct light, which is possible only if both would compute the
/// same.
fn keeps_direct_light(settings: &AllSettings) -> bool {
    let own = &settings.of.cones;
    let same = match settings.lights.shadows {
        Shadows::None => true,
        Shadows::Rays => own.first_bounce_shadows,
        Shadows::Method => false,
    };
    own.passes == Passes::Cells && settings.bounces.stored() > 1 && same
}

/// A layered pass: one triangle over the screen per slice of a volume's level.
fn layered(context: &Arc<Context>, label: &str, fragment: &str, constants: &[Constant]) -> Result<Raster> {
    let desc = RasterDesc {
        label,
        vertex: "gi/cones/layered.vert",
        fragment: Some(fragment),
        constants,
        color_formats: &[FORMAT; FACES],
        ..Default::default()
    };
    Raster::new(context, &desc)
}
