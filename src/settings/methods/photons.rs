//! The table `[photons]`: what the notes leave open, and what is mended of what they print.

use serde::{Deserialize, Serialize};

use crate::settings::{Form, Key, Range, choices, key, names, rare, switches};

choices! {
    /// Which voxels a triangle fills.
    Voxels {
        /// Those into which samples of a multisampled raster fall: neither conservative rasterisation nor a geometry
        /// shader.
        Samples = "samples",
        /// All that it touches, by the ground's conservative raster; a second raster counts samples.
        Conservative = "conservative",
    }
}

choices! {
    /// How the spheres of a cone hide each other.
    Composite {
        /// Each hides a share of what is behind it, as if they were independent.
        Over = "over",
        /// What they hide adds up to 1: neighbours find parts of one wall.
        Sum = "sum",
    }
}

choices! {
    /// How much a voxel stands in the way.
    Opacity {
        /// The share of samples of the triangle's column, the same from everywhere.
        Samples = "samples",
        /// The area that the samples measure, as it faces travellers along each axis, to and fro.
        Sided = "sided",
    }
}

choices! {
    /// What the exponentially weighted visibility multiplies.
    AoMultiplies {
        /// Nothing: it is a layer.
        Nothing = "nothing",
        /// All light that a cone finds.
        Light = "light",
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Cones for diffuse light per pixel,
    pub diffuse: u32,
    /// and per voxel side in the second bounce.
    pub bounce: u32,
    /// Cones for a rough lobe.
    pub glossy: u32,
    pub voxelise: Voxels,
    /// Of the raster that measures coverage, per pixel; fewer where the device has not as many.
    pub samples: u32,
    pub opacity: Opacity,
    pub composite: Composite,
    /// Whether dark backs stand in the way.
    pub keep_backs: bool,
    /// Whether the set of diffuse cones turns from place to place.
    pub turn: bool,
    /// Least extent of a sphere, voxels.
    pub least_step: f32,
    /// Largest radius of a sphere over its distance.
    pub most_ratio: f32,
    /// Where cones start, voxels: along the normal,
    pub start_normal: f32,
    /// and along the cone.
    pub start_along: f32,
    /// λ of the exponential weight of visibility, per metre.
    pub ao_rate: f32,
    pub ao_multiplies: AoMultiplies,
    pub ledger: Ledger,
}

switches! {
    /// What the notes print that is wrong and is neither a choice nor a number above, each on its own.
    "see docs/photons.md";
    beer 0 "photons.ledger.beer" "exponent of Beer's law, with composite = over: diameter/increment, or length/edge",
    steps 1 "photons.ledger.steps" "spheres: h' = (h + hR)/(1 − R) for every R, or bounded",
    still 2 "photons.ledger.still" "where R or h is 0: the recursion stands still, or spheres are photons.least_step wide",
    color 3 "photons.ledger.color" "what colour is weighted with: the opacity that was read, or that of the step",
    ao 4 "photons.ledger.ao" "the exponential sum: visibility beyond each sphere, without start and end, or whole",
    mips 5 "photons.ledger.mips" "mips: photons summed as they are, or as far as they are seen and fill no more than all",
    directions 6 "photons.ledger.directions" "a texel of the octahedral map: at its middle, or its mean",
    seams 7 "photons.ledger.seams" "filtering at the octahedral map's border: repeated, or folded",
    premultiplied 8 "photons.ledger.premultiplied" "light of the map: with its own opacity, or with that of the opacity volume",
}

impl Default for Settings {
    /// The preset `photons`: every fault of the notes mended.
    fn default() -> Self {
        Self {
            diffuse: 8,
            bounce: 4,
            glossy: 8,
            voxelise: Voxels::Samples,
            samples: 8,
            opacity: Opacity::Sided,
            composite: Composite::Sum,
            keep_backs: false,
            turn: false,
            least_step: 1.0,
            most_ratio: 0.5,
            start_normal: 1.5,
            start_along: 0.0,
            ao_rate: 0.0,
            ao_multiplies: AoMultiplies::Nothing,
            ledger: Ledger::default(),
        }
    }
}

impl Settings {
    /// The preset `photons-printed`: the notes' formulas, where they can run.
    pub fn printed() -> Self {
        Self {
            opacity: Opacity::Samples,
            composite: Composite::Over,
            keep_backs: true,
            ledger: Ledger::all(Form::Printed),
            ..Self::default()
        }
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[
    &[
        key(
            "photons.diffuse",
            "cones",
            Range::Whole(1, 128),
            "cones for diffuse light per gathered pixel, cosine-distributed, each as wide as its share",
            "a cone each: the image's time grows with them, and narrow cones take more steps",
        ),
        rare(key(
            "photons.bounce",
            "cones",
            Range::Whole(1, 128),
            "the same per voxel side, of the second bounce",
            "a cone each",
        )),
        rare(key(
            "photons.glossy",
            "cones",
            Range::Whole(1, 64),
            "cones for a rough mirrored lobe; a smooth one takes one",
            "a cone each, where something is glossy",
        )),
        rare(key(
            "photons.voxelise",
            "choice",
            names!(Voxels),
            "which voxels a triangle fills: those that samples of a multisampled raster find, or those of a conservative raster, whose \
             samples a second raster counts",
            "conservative adds a geometry shader, an exact test of every voxel, and the pass cover",
        )),
        rare(key(
            "photons.samples",
            "samples",
            Range::OneOf(&[1, 4, 8]),
            "samples per pixel that measure how much of a voxel a triangle fills; the most that the device has, up to this",
            "the pass that takes them alone: voxelise, or cover",
        )),
        rare(key(
            "photons.opacity",
            "choice",
            names!(Opacity),
            "how much a voxel stands in the way: its share of samples from everywhere, or the area that faces the traveller",
            "sided looks up three values per step instead of one",
        )),
        rare(key(
            "photons.composite",
            "choice",
            names!(Composite),
            "how spheres hide each other: over, or sum (what one wall hides adds up to 1)",
            "sum continues a little past the grid's border",
        )),
        rare(key(
            "photons.keep_backs",
            "switch",
            Range::Bool,
            "dark backs stand in the way of what leaves their front: fewer leaks through single planes, darker at walls",
            "none",
        )),
        rare(key("photons.turn", "switch", Range::Bool, "turn the diffuse cones per pixel: noise instead of bands", "little")),
        rare(key(
            "photons.least_step",
            "voxels",
            Range::Number(0.1, 4.0),
            "least extent of a cone's sphere",
            "smaller is slower: more spheres near the apex",
        )),
        rare(key(
            "photons.most_ratio",
            "ratio",
            Range::Number(0.01, 0.95),
            "largest radius of a sphere over its distance: at 1 no spheres touch",
            "larger is faster: fewer spheres per cone",
        )),
        rare(key(
            "photons.start_normal",
            "voxels",
            Range::Number(0.0, 8.0),
            "where cones start, along the normal",
            "no time; more: less self-light, less contact",
        )),
        rare(key(
            "photons.start_along",
            "voxels",
            Range::Number(0.0, 8.0),
            "where cones start, along the cone",
            "no time; more: less self-light, less contact",
        )),
        rare(key(
            "photons.ao_rate",
            "per metre",
            Range::Number(0.0, 1e3),
            "rate of the exponential weight of visibility; 0: what a cone sees in the end",
            "little",
        )),
        rare(key(
            "photons.ao_multiplies",
            "choice",
            names!(AoMultiplies),
            "what weighted visibility multiplies: nothing (it is the layer ao), or all light that a cone finds",
            "none",
        )),
    ],
    LEDGER_KEYS,
];
