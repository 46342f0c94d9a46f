//! Presets: named settings, each defined by its differences from another preset.

use super::methods::cones::choices::ConeSet;
use super::methods::{cones, lpv, photons, rays};
use super::{Bounces, Conservative, GatherResolution, LampLight, Method, Settings, Shadows};

/// Named settings.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    pub name: &'static str,
    /// Purpose of the preset.
    pub meaning: &'static str,
    pub settings: fn() -> Settings,
}

/// Every preset. The first one is the default of the command line.
pub const PRESETS: &[Preset] = &[
    preset("balanced", Settings::default, "14 shared rays for every 4 pixels, lamps sampled"),
    preset("fast", Settings::fast, "9 shared rays for every 16 pixels, lamps sampled, one sample per pixel"),
    preset("accurate", Settings::accurate, "44 shared rays a pixel, lamps sampled"),
    preset("cones", Settings::cones, "16 saturating cones a pixel, lamps sampled"),
    preset(
        "corrected-16",
        Settings::corrected_16,
        "the talk with every error corrected, and its set of sixteen diffuse cones",
    ),
    preset("corrected", Settings::corrected, "the talk with every error of the ledger corrected, and its set of five"),
    preset("printed", Settings::printed, "the talk's listings as printed, where they can run"),
    preset("lpv", Settings::lpv, "light propagation volumes that conserve light, lamps sampled"),
    preset("lpv-printed", Settings::lpv_printed, "light propagation volumes by their source's page and author"),
    preset("photons", Settings::photons, "8 shared cones a pixel through photons, lamps sampled"),
    preset("paths", Settings::paths, "4 paths a pixel and pass with all bounces: path tracing on the device"),
    preset("photons-printed", Settings::photons_printed, "the notes on photons as printed, where they can run"),
    preset("probes", Settings::probes, "8³ irradiance probes of 256 rays, lamps sampled"),
];

const fn preset(name: &'static str, settings: fn() -> Settings, meaning: &'static str) -> Preset {
    Preset { name, meaning, settings }
}

impl Settings {
    /// Nine rays at every fourth pixel along each side, and edges without anti-aliasing.
    pub fn fast() -> Self {
        let mut fast = Self::default();
        fast.lights.shadow_rays = 1;
        fast.lights.lamp_points = 4;
        fast.image.samples = 1;
        fast.image.gather_resolution = GatherResolution::Quarter;
        fast.of.rays = rays::Settings { diffuse: 9, bounce: 2, glossy: 8, ..rays::Settings::default() };
        fast
    }

    /// Forty-four rays at every pixel.
    pub fn accurate() -> Self {
        let mut accurate = Self::default();
        accurate.lights.shadow_rays = 16;
        accurate.lights.lamp_points = 32;
        accurate.lights.voxel_lamp_points = 8;
        accurate.image.gather_resolution = GatherResolution::Full;
        accurate.of.rays = rays::Settings { diffuse: 44, bounce: 8, glossy: 32, ..rays::Settings::default() };
        accurate
    }

    /// Cones with the most accurate settings.
    pub fn cones() -> Self {
        let mut cones = Self { method: Method::Cones, ..Self::default() };
        cones.lights.shadow_rays = 1;
        cones.lights.voxel_lamp_points = 16;
        cones.image.gather_resolution = GatherResolution::Full;
        cones.image.interleave = 1;
        cones
    }

    /// The talk as printed, as far as it can run.
    pub fn printed() -> Self {
        let mut printed = Self::cones();
        printed.lights.shadows = Shadows::Method;
        printed.lights.lamps = LampLight::Gathered;
        printed.of.cones = cones::Settings::printed();
        printed.grid.conservative = Conservative::GeometryShader;
        printed
    }

    /// Light propagation volumes with the source's errors corrected where that is possible.
    pub fn lpv() -> Self {
        let mut lpv = Self { method: Method::Lpv, ..Self::default() };
        lpv.lights.shadow_rays = 1;
        // Only shadow rays use the base grid.
        lpv.voxels = 64;
        // A cell averages over its whole list, so sharing among neighbours would not help; its light is as smooth as
        // cells are large.
        lpv.image.interleave = 1;
        lpv.image.gather_resolution = GatherResolution::Quarter;
        lpv
    }

    /// Light propagation as in the source: its page and its author's other publications. Everything else is as in
    /// [`Settings::lpv`].
    pub fn lpv_printed() -> Self {
        let mut printed = Self::lpv();
        printed.lights.lamps = LampLight::Gathered;
        printed.image.gather_resolution = GatherResolution::Full;
        printed.of.lpv = lpv::Settings::printed();
        printed
    }

    /// The talk with every row of the ledger corrected.
    pub fn corrected() -> Self {
        let mut corrected = Self::printed();
        corrected.of.cones = cones::Settings::corrected();
        corrected
    }

    /// [`Settings::corrected`] with the sixteen diffuse cones that the talk also prints.
    pub fn corrected_16() -> Self {
        let mut corrected = Self::corrected();
        corrected.of.cones.set = ConeSet::Sixteen;
        corrected
    }

    /// Cones through photons with the most accurate settings.
    pub fn photons() -> Self {
        let mut photons = Self { method: Method::Photons, ..Self::cones() };
        photons.image.interleave = Self::default().image.interleave;
        photons
    }

    /// Path tracing: the only error is noise.
    pub fn paths() -> Self {
        let mut paths = Self { method: Method::Paths, bounces: Bounces::All, ..Self::default() };
        paths.image.samples = 1;
        paths.image.interleave = 1;
        paths.image.gather_resolution = GatherResolution::Full;
        paths
    }

    /// The formulas of the notes as printed, where they can run. Everything else is as in [`Self::photons`].
    pub fn photons_printed() -> Self {
        let mut printed = Self::photons();
        printed.of.photons = photons::Settings::printed();
        printed
    }

    /// Irradiance probes as their papers have them, with as many rays at once as an image without passes before it asks
    /// for.
    pub fn probes() -> Self {
        let mut probes = Self { method: Method::Probes, ..Self::default() };
        probes.lights.shadow_rays = 1;
        // Each ray of a probe is lit where it ends, and a texel sums up a hundred of them.
        probes.lights.voxel_lamp_points = 1;
        // Nothing but rays goes through the base grid.
        probes.voxels = 64;
        probes
    }
}
