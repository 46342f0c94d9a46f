//! Voxel cone tracing derived from photon mapping: one file per pass.
//!
//! The source is a set of notes ("VCT (Voxel Cone Tracing)") that take a voxel for a photon: [`ledger`] lists what of them is wrong
//! or open, and what is done instead. Samples of a multisampled raster measure how much of each voxel a triangle fills; every
//! list item is lit; a voxel sums up what its items send in sixteen directions, and how much they stand in the way. Cones are
//! drawn by the BRDF, each as wide as its share of it, and go through the volume in spheres that touch.

pub mod constants;
pub mod cover;
mod fill;
pub mod ledger;
mod mips;
mod settings;
mod volume;

use super::{CoarseLight, Gi, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::{DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ, LAMP_POINTS, LIT, with};
use crate::ground::faces::FillDesc;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::{Bounces, Settings as AllSettings};
use crate::vk::{Bind, Image, Recorder};
use constants::{DIFFUSE_CONES, SAMPLES};
use cover::Cover;
use fill::Fill;
use mips::{Empty, Mips};
pub use settings::{AoMultiplies, Composite, Form, KEYS, Ledger, Opacity, Settings};
pub use volume::PhotonVolume;

pub const PASS_UNITS: &[(&str, PassUnit)] =
    &[("cover", PassUnit::WalkedItems), ("shade", PassUnit::WalkedItems), ("mips", PassUnit::Voxels)];

pub struct Lighting {
    cover: Cover,
    first: Fill,
    /// The first bounce with the last frame's light to gather from; absent unless `bounces = all`.
    again: Option<Fill>,
    second: Option<Fill>,
    empty: Empty,
    mips: Mips,
    /// One per bounce.
    volumes: Vec<PhotonVolume>,
    constants: Vec<(u32, u32)>,
}

impl Gi for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        Wants {
            lists: true,
            cells: true,
            lit_items: true,
            alike: true,
            item_samples: true,
            kept_direct_light: settings.bounces.volumes() > 1,
            diffuse: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        PhotonVolume::plan(settings)
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.photons;
        let samples = cover::samples(context, own.samples)?;
        let constants = constants::constants(own);
        let voxels = with(crate::ground::constants::constants(settings, features), &constants);
        let of_items = [
            (DIFFUSE_CONES, own.bounce),
            (SAMPLES, samples),
            (LAMP_POINTS, settings.lights.voxel_lamp_points),
            (LIT, 1),
        ];
        let voxels = with(voxels, &of_items);
        let fill = |label, gathers, direct| {
            Fill::new(context, &FillDesc { label, folder: "photons", gathers, direct, constants: &voxels })
        };
        let two = settings.bounces.volumes() > 1;
        let direct = if two { DIRECT_KEPT } else { DIRECT_FOUND };
        Ok(Self {
            cover: Cover::new(context, &voxels, samples)?,
            first: fill("shade 1", false, direct)?,
            again: (settings.bounces == Bounces::All).then(|| fill("shade 1", true, direct)).transpose()?,
            second: two.then(|| fill("shade 2", true, DIRECT_READ)).transpose()?,
            empty: Empty::new(context, &voxels)?,
            mips: Mips::new(context, &voxels)?,
            volumes: PhotonVolume::per_bounce(context, settings)?,
            constants,
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        let [first, rest @ ..] = &self.volumes[..] else { return };
        if update.lists {
            // Samples say how much of its voxel every listed triangle fills.
            self.cover.record(r, ground);
            // What the last lists filled and these do not is emptied.
            self.volumes.iter().for_each(|volume| self.empty.record(r, ground, volume, update.known));
        }
        match (&self.again, rest) {
            // Every photon is lit directly and, with all bounces, by what the last frame left,
            (Some(again), [second]) if update.history => again.record(r, ground, first, second.binds().collect()),
            // or directly alone; the voxels sum up what their photons send,
            _ => self.first.record(r, ground, first, Vec::new()),
        }
        // and coarser voxels sum up finer ones, per direction.
        self.mips.record(r, ground, first);
        if let (Some(light), [second]) = (&self.second, rest) {
            // Every photon is lit once more, with what cones into the first bounce find.
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

    /// Of each bounce the map, then opacity forth and back.
    fn images(&self) -> Vec<&Image> {
        self.volumes.iter().flat_map(PhotonVolume::images).collect()
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.volumes.last().map(PhotonVolume::coarse)
    }
}
