//! The one settings tree: what every key means, its unit, range and cost. Presets are values of it.
//!
//! Lengths inside the volume are counted in voxels, so that a scene scaled or moved gives the same image.

mod choices;
mod docs;
mod edit;
mod keys;
mod presets;

pub use choices::{
    Blend, Bounces, ConeSet, DirectLight, Emitters, Fill, Form, Gather, GatherResolution, Lists, Reuse, RoughnessFit,
    ShadeDirect, ShadeItems, Shadows, Weights, Work,
};
pub use docs::markdown;
pub use keys::{KEYS, Key, Range};
pub use presets::{PRESETS, Preset};

use serde::{Deserialize, Serialize};

/// Every setting. `twobounce settings` prints this tree; `--set key=value` writes into it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub voxels: u32,
    pub gather: Gather,
    pub cones: ConeSet,
    pub bounces: Bounces,
    pub fill: Fill,
    pub weights: Weights,
    pub blend: Blend,
    /// Diffuse and specular cones: length of a step over the cone's diameter.
    pub step: f32,
    /// What the diffuse set's apertures are multiplied with.
    pub aperture: f32,
    /// How far past the volume's border a sum goes on, in diameters.
    pub exit_margin: f32,
    pub shadows: Shadows,
    pub emitters: Emitters,
    /// Points on lamps per pixel and voxel side with `emitters = sampled`.
    pub emitter_samples: u32,
    pub lists: Lists,
    pub shading: Work,
    pub mips: Work,
    pub reuse: Reuse,
    pub roughness_fit: RoughnessFit,
    /// What looks where a glossy surface mirrors. Of the image; voxels have no viewer and use a cone.
    pub specular: Gather,
    /// What looks through glass.
    pub refraction: Gather,
    /// Rays for a rough lobe that sends on all that it gets; fainter ones take their share of them.
    pub specular_rays: u32,
    /// Shadow rays and cones in the first bounce too (the talk lights it without shadows).
    pub first_bounce_shadows: bool,
    /// Rotate the diffuse cone set per pixel.
    pub jitter: bool,
    pub shade: Shade,
    pub volume: Volume,
    pub start: Start,
    pub shadow: Shadow,
    /// Neighbours within a square of so many pixels look along directions of their own, and share what they find.
    pub interleave: u32,
    pub gather_resolution: GatherResolution,
    pub image: ImageSettings,
    pub ledger: Ledger,
}

/// How voxels are shaded; absent: as the image is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shade {
    #[serde(with = "auto")]
    pub gather: Option<Gather>,
    #[serde(with = "auto")]
    pub cones: Option<ConeSet>,
    /// Points on lamps per voxel side.
    #[serde(with = "auto")]
    pub emitter_samples: Option<u32>,
    pub direct: ShadeDirect,
    pub items: ShadeItems,
}

/// Where the volume stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Volume {
    /// World metres; the scene's centre where absent.
    #[serde(with = "auto")]
    pub center: Option<[f64; 3]>,
    /// World metres; the scene's longest side plus the margin where absent.
    #[serde(with = "auto")]
    pub side: Option<f64>,
    /// Voxels on each side. Not a whole number, so that the walls of box-shaped scenes do not lie on voxel boundaries.
    pub margin: f64,
}

/// Where cones start, in voxels (D16, D20, D23): along the normal, then along the cone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Start {
    pub diffuse_normal: f32,
    pub diffuse_along: f32,
    pub specular_normal: f32,
    pub specular_along: f32,
    pub refraction_normal: f32,
    pub refraction_along: f32,
    pub shadow_normal: f32,
    pub shadow_along: f32,
    /// How far before the light a shadow cone stops.
    pub shadow_end: f32,
}

/// Shadows of lights with an extent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shadow {
    /// Rays to a light that has a radius, with `shadows = rays`; one ray goes to its middle.
    pub rays: u32,
    /// Length of a step over the cone's diameter.
    pub step: f32,
    /// Half angle in degrees of every light's shadow cone; absent: from the light's own radius.
    #[serde(with = "auto")]
    pub half_angle: Option<f32>,
}

/// The final image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageSettings {
    /// Samples per pixel: 1 or 4. Edges are anti-aliased, cones are traced once per pixel.
    pub samples: u32,
    pub direct: DirectLight,
}

/// The rows of `docs/ledger.md` that change an image and are neither a choice nor a number above.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ledger {
    /// Which volumes the −x −y −z mips read.
    pub d1: Form,
    /// The −y mip's fourth column.
    pub d2: Form,
    /// The axis of cone set 6a.
    pub d6: Form,
    /// The jitter's rotation matrix.
    pub d7: Form,
    /// The jitter's angle.
    pub d8: Form,
    /// How far a cone reaches: √2, or the exit from the cube.
    pub d10: Form,
    /// The volume's border: its edge voxels repeated for ever, or transparent black.
    pub d11: Form,
    /// Opacity correction of the shadow cone's short steps.
    pub d12: Form,
    /// The shadow cone's mip level.
    pub d13: Form,
    /// The shadow cone's volume: isotropic, or directional.
    pub d15: Form,
    /// The cone's diameter: max(1/N, 2t)·s, or max(1/N, 2t·s).
    pub d17: Form,
    /// When a cone ends: alpha ≥ 1, or near 1.
    pub d18: Form,
    /// The sky behind the diffuse cones: dropped, or through the remaining alpha.
    pub d21: Form,
    /// The tangent frame about the normal.
    pub d22: Form,
    /// Where refraction starts: outside the surface, or on the refracted side.
    pub d23: Form,
    /// Refraction at back faces and total reflection.
    pub d24: Form,
    /// Set 16's weights: equal, or cosine.
    pub d26: Form,
}

impl Default for Settings {
    /// Preset `corrected`: every row of the ledger right.
    fn default() -> Self {
        Self {
            voxels: 128,
            gather: Gather::Cones,
            cones: ConeSet::Five,
            bounces: Bounces::Two,
            fill: Fill::Uniform,
            weights: Weights::D2,
            blend: Blend::Over,
            step: 1.0,
            aperture: 1.0,
            exit_margin: 1.0,
            shadows: Shadows::Rays,
            emitters: Emitters::Cones,
            emitter_samples: 16,
            lists: Lists::Rebuild,
            shading: Work::Raster,
            mips: Work::Raster,
            reuse: Reuse::None,
            roughness_fit: RoughnessFit::Polynomial,
            specular: Gather::Cones,
            refraction: Gather::Cones,
            specular_rays: 8,
            first_bounce_shadows: true,
            jitter: false,
            shade: Shade::default(),
            volume: Volume::default(),
            start: Start::default(),
            shadow: Shadow::default(),
            interleave: 1,
            gather_resolution: GatherResolution::Full,
            image: ImageSettings::default(),
            ledger: Ledger::all(Form::Right),
        }
    }
}

impl Settings {
    /// Whether some pass goes through lists of occupied cells.
    pub fn uses_cells(&self) -> bool {
        self.shading == Work::Cells || self.mips == Work::Cells
    }

    /// Whether any ray walks the lists, in one scene or another.
    pub fn traces_rays(&self) -> bool {
        let gathers = [self.gather, self.of_voxels().gather, self.specular, self.refraction];
        self.shadows == Shadows::Rays || self.emitters == Emitters::Sampled || gathers.contains(&Gather::Rays)
    }

    /// The settings by which voxels are shaded.
    pub fn of_voxels(&self) -> Self {
        let Shade { gather, cones, emitter_samples, .. } = self.shade;
        Self {
            gather: gather.unwrap_or(self.gather),
            cones: cones.unwrap_or(self.cones),
            emitter_samples: emitter_samples.unwrap_or(self.emitter_samples),
            ..self.clone()
        }
    }

    /// Whether the second bounce takes over the first one's direct light: only where both would find the same.
    pub fn keeps_direct(&self) -> bool {
        let same = match self.shadows {
            Shadows::None => true,
            Shadows::Rays => self.first_bounce_shadows,
            Shadows::Cones => false,
        };
        self.shade.direct == ShadeDirect::Kept && self.bounces.volumes() == 2 && self.lists == Lists::Reuse && same
    }

    /// Whether triangles that are alike are lit as one: lists that stay, and lit item by item.
    pub fn lights_alike(&self) -> bool {
        self.shade.items == ShadeItems::Alike && self.shading == Work::Cells && self.lists == Lists::Reuse
    }
}

impl Default for Shade {
    fn default() -> Self {
        Self { gather: None, cones: None, emitter_samples: None, direct: ShadeDirect::Again, items: ShadeItems::Each }
    }
}

impl Default for Volume {
    fn default() -> Self {
        Self { center: None, side: None, margin: 2.5 }
    }
}

impl Default for Start {
    fn default() -> Self {
        Self {
            // As printed (D20): a wide cone that starts nearer meets the voxels of its own surface.
            diffuse_normal: 1.0 + 4.0 * std::f32::consts::FRAC_1_SQRT_2,
            diffuse_along: 4.0 - 1.28,
            specular_normal: 1.0,
            specular_along: 1.0,
            refraction_normal: 1.0,
            refraction_along: 1.0,
            shadow_normal: 2.0,
            shadow_along: 2.5,
            shadow_end: 2.0,
        }
    }
}

impl Default for Shadow {
    fn default() -> Self {
        Self { rays: 1, step: 1.0 / 3.0, half_angle: None }
    }
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self { samples: 4, direct: DirectLight::Samples }
    }
}

impl Default for Ledger {
    fn default() -> Self {
        Self::all(Form::Right)
    }
}

impl Ledger {
    /// Every row in one form.
    pub fn all(form: Form) -> Self {
        Self {
            d1: form,
            d2: form,
            d6: form,
            d7: form,
            d8: form,
            d10: form,
            d11: form,
            d12: form,
            d13: form,
            d15: form,
            d17: form,
            d18: form,
            d21: form,
            d22: form,
            d23: form,
            d24: form,
            d26: form,
        }
    }
}

/// `"auto"` stands for an absent value, so that files can say it and lists can show it.
mod auto {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Either<T> {
        Value(T),
        Word(String),
    }

    pub fn serialize<T: Serialize + Copy, S: Serializer>(value: &Option<T>, to: S) -> Result<S::Ok, S::Error> {
        value.map_or(Either::Word("auto".into()), Either::Value).serialize(to)
    }

    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
        match Either::deserialize(from)? {
            Either::Value(value) => Ok(Some(value)),
            Either::Word(word) if word == "auto" => Ok(None),
            Either::Word(word) => Err(serde::de::Error::custom(format!("{word:?} is not \"auto\""))),
        }
    }
}
