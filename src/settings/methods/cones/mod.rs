//! The settings `[cones]`: the talk's variants, and the rows of its ledger.

pub mod choices;

use crate::settings::{Key, Range, auto, names, switches, table};
use crate::vk::SamplerAddressMode;
use choices::{Blend, ConeSet, Fill, Form, Passes, RoughnessFit, Weights, Wrap};

table! {
    /// The defaults are those of the preset `cones`: fill, weights and compositing are chosen together, so that the
    /// alpha of a wall adds up to 1 from every angle.
    Settings as "cones" {
        set: ConeSet = ConeSet::G16, in "set", names!(ConeSet);
        "diffuse cones around the normal: the talk's five sets, and cosine-distributed ones (g)";
        "the image's time grows with the number: ×2 from 1 to 5, ×1.7 to 6, ×5.7 to 16";
        fill: Fill = Fill::Sided, in "choice", names!(Fill);
        "filling of a voxel's faces: uniform keeps energy, facing leaks less, coverage clips exactly, sided drops dark backs, front all backs";
        "coverage and sided clip each listed triangle: more shading time";
        weights: Weights = Weights::Abs, in "choice", names!(Weights);
        "mix of the three facing volumes along a cone: d2, norm1 (both sum to 1), abs (brightens), extinction";
        "extinction takes three logarithms per step";
        blend: Blend = Blend::Sum, in "choice", names!(Blend);
        "compositing along a cone: over, or sum (the alpha of a wall adds up to 1; with fill = sided, weights = abs)";
        "sum continues a little past the grid's border";
        step: f32 = 1.0, in "diameters", Range::Number(0.1, 4.0);
        "length of a cone's step";
        "larger is faster: fewer samples per cone";
        passes: Passes = Passes::Cells, in "choice", names!(Passes);
        "layered: volumes by layers with two voxelisations, pixels by triangles, as in the talk; cells: occupied cells and fragments in compute shaders. The image is the same";
        "layered grows with the grid; cells grows with occupied voxels, and takes 56 bytes per list item";
        aperture: f32 = 1.0, in "factor" rare, Range::Number(0.05, 4.0);
        "factor of the apertures of the diffuse cones";
        "larger is faster: wider cones take fewer steps";
        exit_margin: f32 = 1.0, in "diameters" rare, Range::Number(0.0, 4.0);
        "continuation of a cone past the border of the grid with blend = sum, an eighth of the grid at most";
        "a step or two per cone that leaves the grid";
        roughness_fit: RoughnessFit = RoughnessFit::Polynomial, in "choice" rare, names!(RoughnessFit);
        "specular cone's half angle from roughness: polynomial 47.5°, power 41°, linear 67.5° at roughness 1; ggx: fitted to \
         the lobe, narrow where it is smooth";
        "larger angles are faster: fewer samples per cone";
        first_bounce_shadows: bool = true, in "switch" rare, Range::Bool;
        "with lights.shadows = rays: shadow lights in the first bounce too; the talk's has no volume to do so, and is too bright";
        "a shadow test per light and shaded voxel of the first bounce";
        jitter: bool = false, in "switch" rare, Range::Bool;
        "turn the diffuse cones per pixel: noise instead of bands";
        "little";
        shadow_step: f32 = 1.0 / 3.0, in "diameters" rare, Range::Number(0.05, 1.0);
        "step of a shadow cone over its diameter";
        "time in inverse proportion: smaller is slower";
        shadow_jitter: bool = false, in "switch" rare, Range::Bool;
        "start each shadow cone at a random share of a step, as the talk does: noise instead of bands";
        "little; in a sequence it turns with time, and no frame's light is kept for the next";
        #[serde(with = "auto")]
        shadow_half_angle: Option<f32> = None, in "degrees" rare, Range::NumberOrAuto(0.1, 45.0);
        "half angle of every shadow cone; auto: from each light's radius";
        "larger is faster: fewer samples per cone";
        wrap: Wrap = Wrap::Clamp, in "choice" rare, names!(Wrap);
        "volume beyond the cube where row D11 is printed: edge voxels, or the cube repeated";
        "none";
    } + { start: Start, ledger: Ledger }
}

const DISTANCE: Range = Range::Number(0.0, 64.0);
const MORE: &str = "no time; more: less self-light, less contact";

table! {
    /// The start of cones (D16, D19, D20, D23): along the normal, then along the cone.
    Start as "cones.start" {
        diffuse_normal: f32 = 1.0, in "voxels" rare, DISTANCE;
        "start of diffuse cones along the normal";
        MORE;
        diffuse_along: f32 = 0.5, in "voxels" rare, DISTANCE;
        "start of diffuse cones along the cone";
        MORE;
        diffuse_offset: f32 = 0.0, in "voxels" rare, Range::Number(-64.0, 64.0);
        "offset of diffuse cones along themselves, without a change of width";
        "no time; negative: more self-light";
        specular_normal: f32 = 1.0, in "voxels" rare, DISTANCE;
        "start of specular cones along the normal";
        MORE;
        specular_along: f32 = 1.0, in "voxels" rare, DISTANCE;
        "start of specular cones along the cone";
        MORE;
        refraction_normal: f32 = 1.0, in "voxels" rare, DISTANCE;
        "start of refraction cones along the normal";
        MORE;
        refraction_along: f32 = 1.0, in "voxels" rare, DISTANCE;
        "start of refraction cones along the cone";
        MORE;
        shadow_normal: f32 = 2.0, in "voxels" rare, DISTANCE;
        "start of shadow cones along the normal";
        MORE;
        shadow_along: f32 = 2.5, in "voxels" rare, DISTANCE;
        "start of shadow cones along the cone";
        MORE;
        shadow_end: f32 = 2.0, in "voxels" rare, DISTANCE;
        "distance before the light at which a shadow cone stops";
        MORE;
    }
}

switches! {
    /// Rows of `docs/notes/ledger.md` that change an image and are neither a choice nor a number above.
    "cones.ledger", "see docs/notes/ledger.md";
    d1 1 "D1: which volumes the −x −y −z mips read",
    d2 2 "D2: the −y mip's fourth column",
    d6 6 "D6: the axis of cone set 6a",
    d7 7 "D7: the jitter's rotation matrix",
    d8 8 "D8: the jitter's angle",
    d10 10 "D10: how far a cone reaches: √2, or the exit from the cube",
    d11 11 "D11: beyond the cube: what cones.wrap says, or nothing",
    d12 12 "D12: opacity correction of the shadow cone's short steps",
    d13 13 "D13: the shadow cone's mip level",
    d15 15 "D15: the shadow cone's volume: isotropic, or directional",
    d17 17 "D17: the cone's diameter: max(1/N, 2t)·s, or max(1/N, 2t·s)",
    d18 18 "D18: when a cone ends: alpha ≥ 1, or near 1",
    d19 19 "D19: the diffuse cones' offset: a share of the cube (of 128 voxels), or in voxels",
    d21 21 "D21: the sky behind cones: dropped, or through the remaining alpha",
    d22 22 "D22: the tangent frame about the normal",
    d23 23 "D23: where refraction starts: outside the surface, or on the refracted side",
    d26 26 "D26: set 16's weights: equal, or cosine",
    d30 30 "D30: which voxels list a triangle: those that it touches once dilated, or those that it touches",
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

    /// The preset `corrected`: `printed` with every row of the ledger corrected, and no other change.
    pub fn corrected() -> Self {
        let printed = Self::printed();
        let start = Start { shadow_end: Start::default().shadow_end, ..printed.start };
        Self { start, ledger: Ledger::default(), ..printed }
    }

    /// Addressing beyond the cube (D11). In the corrected form there is no light outside.
    pub fn address_mode(&self) -> SamplerAddressMode {
        match (self.ledger.d11, self.wrap) {
            (Form::Right, _) => SamplerAddressMode::CLAMP_TO_BORDER,
            (_, Wrap::Clamp) => SamplerAddressMode::CLAMP_TO_EDGE,
            (_, Wrap::Repeat) => SamplerAddressMode::REPEAT,
        }
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS, Start::KEYS, Ledger::KEYS];
