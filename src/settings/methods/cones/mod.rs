//! The table `[cones]`: the talk's variants, and the rows of its ledger.

pub mod choices;

use serde::{Deserialize, Serialize};

use crate::settings::{Key, Range, auto, key, names, rare, switches};
use choices::{Blend, ConeSet, Fill, Form, Passes, RoughnessFit, Weights, Wrap};
use crate::vk::SamplerAddressMode;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Diffuse cones.
    pub set: ConeSet,
    pub fill: Fill,
    pub weights: Weights,
    pub blend: Blend,
    /// Diffuse and specular cones: length of a step over the cone's diameter.
    pub step: f32,
    /// What the diffuse set's apertures are multiplied with.
    pub aperture: f32,
    /// How far past the grid's border a sum continues, in diameters.
    pub exit_margin: f32,
    pub roughness_fit: RoughnessFit,
    pub passes: Passes,
    /// Whether rays shadow lights in the first bounce too; the talk's has no volume that could.
    pub first_bounce_shadows: bool,
    /// Whether the diffuse cone set turns from pixel to pixel.
    pub jitter: bool,
    /// Length of a step of a shadow cone over its diameter.
    pub shadow_step: f32,
    /// Whether each shadow cone starts at a random share of its first step.
    pub shadow_jitter: bool,
    /// Half angle in degrees of every light's shadow cone; absent: from the light's own radius.
    #[serde(with = "auto")]
    pub shadow_half_angle: Option<f32>,
    /// What a volume's sampler reads beyond the cube, where D11 is printed.
    pub wrap: Wrap,
    pub start: Start,
    pub ledger: Ledger,
}

/// Where cones start, in voxels (D16, D19, D20, D23): along the normal, then along the cone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Start {
    pub diffuse_normal: f32,
    pub diffuse_along: f32,
    /// What diffuse cones are moved along themselves: where they look, and not how wide they are there (D19).
    pub diffuse_offset: f32,
    pub specular_normal: f32,
    pub specular_along: f32,
    pub refraction_normal: f32,
    pub refraction_along: f32,
    pub shadow_normal: f32,
    pub shadow_along: f32,
    /// How far before the light a shadow cone stops.
    pub shadow_end: f32,
}

switches! {
    /// The rows of `docs/ledger.md` that change an image and are neither a choice nor a number above.
    "see docs/ledger.md";
    d1 1 "cones.ledger.d1" "D1: which volumes the −x −y −z mips read",
    d2 2 "cones.ledger.d2" "D2: the −y mip's fourth column",
    d6 6 "cones.ledger.d6" "D6: the axis of cone set 6a",
    d7 7 "cones.ledger.d7" "D7: the jitter's rotation matrix",
    d8 8 "cones.ledger.d8" "D8: the jitter's angle",
    d10 10 "cones.ledger.d10" "D10: how far a cone reaches: √2, or the exit from the cube",
    d11 11 "cones.ledger.d11" "D11: beyond the cube: what cones.wrap says, or nothing",
    d12 12 "cones.ledger.d12" "D12: opacity correction of the shadow cone's short steps",
    d13 13 "cones.ledger.d13" "D13: the shadow cone's mip level",
    d15 15 "cones.ledger.d15" "D15: the shadow cone's volume: isotropic, or directional",
    d17 17 "cones.ledger.d17" "D17: the cone's diameter: max(1/N, 2t)·s, or max(1/N, 2t·s)",
    d18 18 "cones.ledger.d18" "D18: when a cone ends: alpha ≥ 1, or near 1",
    d19 19 "cones.ledger.d19" "D19: the diffuse cones' offset: a share of the cube (of 128 voxels), or in voxels",
    d21 21 "cones.ledger.d21" "D21: the sky behind cones: dropped, or through the remaining alpha",
    d22 22 "cones.ledger.d22" "D22: the tangent frame about the normal",
    d23 23 "cones.ledger.d23" "D23: where refraction starts: outside the surface, or on the refracted side",
    d26 26 "cones.ledger.d26" "D26: set 16's weights: equal, or cosine",
    d30 30 "cones.ledger.d30" "D30: which voxels list a triangle: those that it touches once dilated, or those that it touches",
}

impl Default for Settings {
    /// The preset `cones`: fill, weights and compositing changed together, so that a wall's alpha adds up to 1 from every angle.
    fn default() -> Self {
        Self {
            set: ConeSet::G16,
            fill: Fill::Sided,
            weights: Weights::Abs,
            blend: Blend::Sum,
            step: 1.0,
            aperture: 1.0,
            exit_margin: 1.0,
            roughness_fit: RoughnessFit::Polynomial,
            passes: Passes::Cells,
            first_bounce_shadows: true,
            jitter: false,
            shadow_step: 1.0 / 3.0,
            shadow_jitter: false,
            shadow_half_angle: None,
            wrap: Wrap::Clamp,
            start: Start::default(),
            ledger: Ledger::default(),
        }
    }
}

impl Settings {
    /// The preset `printed`: the talk's listings, where they can run.
    pub fn printed() -> Self {
        Self {
            set: ConeSet::Five,
            fill: Fill::Uniform,
            weights: Weights::D2,
            blend: Blend::Over,
            passes: Passes::Layered,
            first_bounce_shadows: false,
            shadow_step: 0.333333,
            shadow_jitter: true,
            shadow_half_angle: Some(5.0),
            start: Start {
                diffuse_normal: 1.0 + 4.0 * std::f32::consts::FRAC_1_SQRT_2,
                diffuse_along: 4.0,
                diffuse_offset: -1.28,
                specular_normal: 2.0,
                specular_along: 2.0,
                shadow_end: 0.0,
                ..Start::default()
            },
            ledger: Ledger::all(Form::Printed),
            ..Self::default()
        }
    }

    /// The preset `corrected`: the same, every row of the ledger right, and nothing else changed.
    pub fn corrected() -> Self {
        let printed = Self::printed();
        let start = Start { shadow_end: Start::default().shadow_end, ..printed.start };
        Self { start, ledger: Ledger::default(), ..printed }
    }

    /// What is beyond the cube (D11): right, nothing.
    pub fn address_mode(&self) -> SamplerAddressMode {
        match (self.ledger.d11, self.wrap) {
            (Form::Right, _) => SamplerAddressMode::CLAMP_TO_BORDER,
            (_, Wrap::Clamp) => SamplerAddressMode::CLAMP_TO_EDGE,
            (_, Wrap::Repeat) => SamplerAddressMode::REPEAT,
        }
    }
}

impl Default for Start {
    fn default() -> Self {
        Self {
            diffuse_normal: 1.0,
            diffuse_along: 0.5,
            diffuse_offset: 0.0,
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

/// A distance in voxels at a cone's start or end.
const fn voxels(name: &'static str, meaning: &'static str) -> Key {
    let range = Range::Number(0.0, 64.0);
    rare(key(name, "voxels", range, meaning, "no time; more: less self-light, less contact"))
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[
    &[
        key(
            "cones.set",
            "set",
            names!(ConeSet),
            "diffuse cones around the normal: the talk's five sets, and cosine-distributed ones (g)",
            "the image's time grows with the number: ×2 from 1 to 5, ×1.7 to 6, ×5.7 to 16",
        ),
        key(
            "cones.fill",
            "choice",
            names!(Fill),
            "how triangles fill a voxel's faces: uniform keeps energy, facing leaks less, coverage clips exactly, sided drops \
             dark backs, front drops all backs, as the author's later engine does",
            "coverage and sided clip each listed triangle: more shading time",
        ),
        key(
            "cones.weights",
            "choice",
            names!(Weights),
            "how the three facing volumes are mixed along a cone: d2, norm1 (both sum to 1), abs (brightens), extinction",
            "extinction takes three logarithms per step",
        ),
        key(
            "cones.blend",
            "choice",
            names!(Blend),
            "how a cone's samples are composited: over, or sum (a wall's alpha adds up to 1; with fill = sided, weights = abs)",
            "sum continues a little past the grid's border",
        ),
        key(
            "cones.step",
            "diameters",
            Range::Number(0.1, 4.0),
            "length of a cone's step",
            "larger is faster: fewer samples per cone",
        ),
        key(
            "cones.passes",
            "choice",
            names!(Passes),
            "how volumes are filled: layer by layer with two voxelisations, as in the talk, or from lists of occupied cells: the \
             same image",
            "layered grows with the grid, cells with what stands in it, and takes 56 bytes per list item",
        ),
        rare(key(
            "cones.aperture",
            "factor",
            Range::Number(0.05, 4.0),
            "what the diffuse set's apertures are multiplied with",
            "larger is faster: wider cones take fewer steps",
        )),
        rare(key(
            "cones.exit_margin",
            "diameters",
            Range::Number(0.0, 4.0),
            "how far past the grid's border a cone with blend = sum continues, an eighth of the grid at most",
            "a step or two per cone that leaves the grid",
        )),
        rare(key(
            "cones.roughness_fit",
            "choice",
            names!(RoughnessFit),
            "specular cone's half angle from roughness: polynomial 47.5°, power 41°, linear 67.5° at roughness 1; ggx: fitted to \
             the lobe, narrow where it is smooth",
            "larger angles are faster: fewer samples per cone",
        )),
        rare(key(
            "cones.first_bounce_shadows",
            "switch",
            Range::Bool,
            "with lights.shadows = rays: shadow lights in the first bounce too; the talk's has no volume to do so, and is too bright",
            "a shadow test per light and shaded voxel of the first bounce",
        )),
        rare(key("cones.jitter", "switch", Range::Bool, "turn the diffuse cones per pixel: noise instead of bands", "little")),
        rare(key(
            "cones.shadow_step",
            "diameters",
            Range::Number(0.05, 1.0),
            "step of a shadow cone over its diameter",
            "time in inverse proportion: smaller is slower",
        )),
        rare(key(
            "cones.shadow_jitter",
            "switch",
            Range::Bool,
            "start each shadow cone at a random share of a step, as the talk does: noise instead of bands",
            "little; in a sequence it turns with time, and no frame's light is kept for the next",
        )),
        rare(key(
            "cones.shadow_half_angle",
            "degrees",
            Range::NumberOrAuto(0.1, 45.0),
            "half angle of every shadow cone; auto: from each light's radius",
            "larger is faster: fewer samples per cone",
        )),
        rare(key(
            "cones.wrap",
            "choice",
            names!(Wrap),
            "what cones meet beyond the cube where row D11 is printed: its edge voxels, or the cube again",
            "none",
        )),
        voxels("cones.start.diffuse_normal", "where diffuse cones start, along the normal"),
        voxels("cones.start.diffuse_along", "where diffuse cones start, along the cone"),
        rare(key(
            "cones.start.diffuse_offset",
            "voxels",
            Range::Number(-64.0, 64.0),
            "how far diffuse cones are moved along themselves, without a change of their width",
            "no time; negative: more self-light",
        )),
        voxels("cones.start.specular_normal", "where specular cones start, along the normal"),
        voxels("cones.start.specular_along", "where specular cones start, along the cone"),
        voxels("cones.start.refraction_normal", "where refraction cones start, along the normal"),
        voxels("cones.start.refraction_along", "where refraction cones start, along the cone"),
        voxels("cones.start.shadow_normal", "where shadow cones start, along the normal"),
        voxels("cones.start.shadow_along", "where shadow cones start, along the cone"),
        voxels("cones.start.shadow_end", "how far before the light a shadow cone stops"),
    ],
    LEDGER_KEYS,
];
