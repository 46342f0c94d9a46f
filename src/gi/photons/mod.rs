//! Voxel cone tracing derived from photon mapping: one file per pass.
//!
//! The source is a set of notes ("VCT (Voxel Cone Tracing)") that take a voxel for a photon: `docs/notes/photons.md`
//! lists what of them is wrong or open, and what is done instead. Samples of a multisampled raster say which voxels a
//! triangle fills, and how much of each; every list item is lit; a voxel sums up what its items send in sixteen
//! directions, and how much they stand in the way. Cones are drawn by the BRDF, each as wide as its share of it, and go
//! through the volume in spheres that touch.

pub mod constants;
pub mod cover;

use super::bounces::{BounceDesc, PerBounce};
use super::{CoarseLight, IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::cell_passes::{EmptyCells, FillCells, FillDesc, MipCells};
use crate::ground::constants::{LIT_GROUPED, with};
use crate::ground::memory_plan::MemoryRow;
use crate::ground::volume::{LightVolume, VolumeImage, VolumeKind};
use crate::ground::voxelise::samples_per_pixel;
use crate::settings::Settings as AllSettings;
use crate::vk::{Bind, Constant, Image, Recorder, SamplerAddressMode};
use cover::Cover;
pub use crate::settings::methods::photons::{Settings, Voxels};

pub const PASS_UNITS: &[(&str, PassUnit)] =
    &[("cover", PassUnit::WalkedItems), ("shade", PassUnit::WalkedItems), ("mips", PassUnit::Voxels)];

/// Of fill and mips: the map of what is sent, and opacity. `tests/device/passes_photons.rs` holds both.
const PARTS: &[&str] = &["", " OPACITY"];

/// The light that every voxel sends in sixteen directions, a texel of an octahedral map each: stored radiance times the
/// area that faces the direction, and that area, over a voxel's face. Every level of the map is 4 × 4 blocks of the
/// level's grid. Beside it the opacity that travellers along +x +y +z meet, with the share of samples, and that of
/// travellers along −x −y −z.
pub const PHOTON_VOLUME: VolumeKind = VolumeKind {
    labels: ["first bounce's", "second bounce's"],
    rows: ["first bounce's photons", "second bounce's photons"],
    parts: &[
        VolumeImage { label: "photons", across: 4, looked_up: "photons", below: "map_below", stored: "photon_map" },
        VolumeImage { label: "opacity forth", across: 1, looked_up: "met_forth", below: "forth_below", stored: "opacity_forth" },
        VolumeImage { label: "opacity back", across: 1, looked_up: "met_back", below: "back_below", stored: "opacity_back" },
    ],
    coarse: 0,
    drawn: false,
    outside: SamplerAddressMode::CLAMP_TO_BORDER,
};

pub struct Lighting {
    /// Unless the lists are made of samples.
    cover: Option<Cover>,
    shade: PerBounce<FillCells>,
    empty: EmptyCells,
    mips: MipCells,
    /// One per bounce.
    volumes: Vec<LightVolume>,
    constants: Vec<Constant>,
}

impl IndirectMethod for Lighting {
    fn wants(settings: &AllSettings) -> Wants {
        let own = &settings.of.photons;
        Wants {
            lists: true,
            sampled: (own.voxelise == Voxels::Samples).then_some(own.samples),
            cells: true,
            last_cells: true,
            lit_items: true,
            grouped: true,
            item_samples: true,
            lobe_words: 4,
            kept_direct_light: settings.bounces.stored() > 1,
            diffuse: true,
            ..Wants::default()
        }
    }

    fn plan(settings: &AllSettings) -> Vec<MemoryRow> {
        LightVolume::plan(&PHOTON_VOLUME, settings)
    }

    fn new(maker: &Maker) -> Result<Self> {
        let Maker { context, settings, features, .. } = *maker;
        let own = &settings.of.photons;
        let samples = samples_per_pixel(context, own.samples)?;
        let constants = constants::constants(own);
        let voxels = with(crate::ground::constants::constants(settings, features), &constants);
        let of_items = [
            ("DIFFUSE_CONES", own.bounce.into()),
            ("SAMPLES", samples.into()),
            ("LAMP_POINTS", settings.lights.voxel_lamp_points.into()),
            ("LIT", LIT_GROUPED.into()),
        ];
        let voxels = with(voxels, &of_items);
        let shade = |BounceDesc { bounce, gathers, direct }| {
            let label = ["shade 1", "shade 2"][bounce];
            let desc = FillDesc { label, folder: "photons", forms: PARTS, gathers, direct, constants: &voxels };
            FillCells::new(context, &desc)
        };
        Ok(Self {
            cover: (own.voxelise == Voxels::Conservative)
                .then(|| Cover::new(context, &voxels, samples))
                .transpose()?,
            shade: PerBounce::new(settings.bounces, settings.bounces.stored() > 1, shade)?,
            empty: EmptyCells::new(context, "gi/photons/empty.comp", &voxels)?,
            mips: MipCells::new(context, "photons", PARTS, &voxels)?,
            volumes: LightVolume::per_bounce(context, PHOTON_VOLUME, settings)?,
            constants,
        })
    }

    fn update(&self, r: &mut Recorder, ground: &Ground, update: &Update) {
        // Samples say how much of its voxel every listed triangle fills, unless the lists say so already.
        if let Some(cover) = self.cover.as_ref().filter(|_| update.lists) {
            cover.record(r, ground);
        }
        self.shade.each(&self.volumes, update.history, |shade, from, to| {
            // Voxels that the last lists filled and the new lists do not are emptied.
            if update.lists {
                self.empty.record(r, ground, to, update.known);
            }
            // Every photon is lit, the voxels sum up what their photons send,
            shade.record(r, ground, to, from.map_or_else(Vec::new, |volume| volume.binds().collect()));
            // and coarser voxels sum up finer ones, per direction.
            self.mips.record(r, ground, to);
        });
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        self.volumes.last().map_or_else(Vec::new, |volume| volume.binds().collect())
    }

    /// Of each bounce the map, then opacity forth and back.
    fn images(&self) -> Vec<&Image> {
        self.volumes.iter().flat_map(|volume| &volume.images).collect()
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.volumes.last().map(LightVolume::coarse)
    }
}
