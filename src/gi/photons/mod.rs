//! Voxel cone tracing derived from photon mapping: one file per pass.
//!
//! The source is a set of notes ("VCT (Voxel Cone Tracing)") that treat a voxel as a photon. `docs/notes/photons.md`
//! lists their errors and open points, and the solutions here. Samples of a multisampled raster find the voxels of a
//! triangle and the share of each that it fills. Every list item is lit. A voxel sums the light that its items send in
//! sixteen directions, and their opacity. Cones are sampled from the BRDF, each as wide as its share of it, and step
//! through the volume in touching spheres.

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

/// Forms of fill and mips: the map of sent light, and opacity. `tests/device/passes_photons.rs` checks both.
const PARTS: &[&str] = &["", " OPACITY"];

/// The light that every voxel sends in sixteen directions, one texel of an octahedral map each: stored radiance times
/// the area that faces the direction, and that area, over the area of a voxel's face. Every level of the map consists
/// of 4 × 4 texels per voxel. Two more images hold opacity: for light that travels along +x +y +z with the share of
/// samples, and for light that travels along −x −y −z.
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
    /// `None` if the lists are made from samples.
    cover: Option<Cover>,
    shade: PerBounce<FillCells>,
    empty: EmptyCells,
    mips: MipCells,
    /// One volume per bounce.
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
        // Samples measure how much of its voxel every listed triangle fills, unless the lists contain that already.
        if let Some(cover) = self.cover.as_ref().filter(|_| update.lists) {
            cover.record(r, ground);
        }
        self.shade.each(&self.volumes, update.history, |shade, from, to| {
            // Voxels that only the previous lists filled are emptied.
            if update.lists {
                self.empty.record(r, ground, to, update.known);
            }
            // Every photon is lit, and the voxels sum the light of their photons.
            shade.record(r, ground, to, from.map_or_else(Vec::new, |volume| volume.binds().collect()));
            // Coarser voxels average finer ones, for each direction.
            self.mips.record(r, ground, to);
        });
    }

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        self.volumes.last().map_or_else(Vec::new, |volume| volume.binds().collect())
    }

    /// For each bounce the map, then both opacities.
    fn images(&self) -> Vec<&Image> {
        self.volumes.iter().flat_map(|volume| &volume.images).collect()
    }

    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.volumes.last().map(LightVolume::coarse)
    }
}
