//! The settings `[photons]`: points that the notes leave open, and corrections of their formulas.

use crate::settings::{Form, Key, Range, choices, names, switches, table};

choices! {
    /// The rule by which a triangle fills voxels.
    Voxels {
        /// Voxels that contain samples of a multisampled raster.
        Samples = "samples",
        /// All voxels that the triangle touches, found by [`grid.conservative`](crate::settings::Conservative); a
        /// raster counts the samples.
        Conservative = "conservative",
    }

    /// The compositing of a cone's spheres.
    Composite {
        /// Each sphere hides a share of the spheres behind it, as if they were independent.
        Over = "over",
        /// The hidden shares add up to at most 1, because neighbouring spheres find parts of one wall.
        Sum = "sum",
    }

    /// The opacity of a voxel.
    Opacity {
        /// The share of samples of the triangle's column, equal in all directions.
        Samples = "samples",
        /// The measured area as seen along each axis, separately for both directions.
        Sided = "sided",
    }

    /// Quantity that the exponentially weighted visibility multiplies.
    AoMultiplies {
        /// Nothing: visibility is only a layer.
        Nothing = "nothing",
        /// All light that a cone finds.
        Light = "light",
    }
}

table! {
    /// The defaults are those of the preset `photons`: every error of the notes is corrected.
    Settings as "photons" {
        diffuse: u32 = 8, in "cones", Range::Whole(1, 128);
        "cones for diffuse light per gathered pixel, cosine-distributed, each as wide as its share";
        "a cone each: the image's time grows with them, and narrow cones take more steps";
        bounce: u32 = 4, in "cones" rare, Range::Whole(1, 128);
        "cones per voxel side for the second bounce";
        "a cone each";
        glossy: u32 = 8, in "cones" rare, Range::Whole(1, 64);
        "cones for a rough mirrored lobe; a smooth one takes one";
        "a cone each, where something is glossy";
        voxelise: Voxels = Voxels::Samples, in "choice" rare, names!(Voxels);
        "voxels that a triangle fills: those that samples of a multisampled raster find, or all that it touches";
        "conservative adds an exact test of every voxel, and the pass cover";
        samples: u32 = 8, in "samples" rare, Range::OneOf(&[1, 4, 8]);
        "samples per pixel that measure how much of a voxel a triangle fills, as far as the device has them";
        "the pass that takes them alone: voxelise, or cover";
        opacity: Opacity = Opacity::Sided, in "choice" rare, names!(Opacity);
        "opacity of a voxel: its share of samples in every direction, or the area along the direction";
        "sided looks up three values per step instead of one";
        composite: Composite = Composite::Sum, in "choice" rare, names!(Composite);
        "compositing of spheres: over, or sum (the opacity of one wall adds up to 1)";
        "sum continues a little past the grid's border";
        keep_backs: bool = false, in "switch" rare, Range::Bool;
        "dark backs block light that leaves their front: fewer leaks through single planes, darker at walls";
        "none";
        turn: bool = false, in "switch" rare, Range::Bool;
        "turn the diffuse cones per pixel: noise instead of bands";
        "little";
        least_step: f32 = 1.0, in "voxels" rare, Range::Number(0.1, 4.0);
        "least extent of a cone's sphere";
        "smaller is slower: more spheres near the apex";
        most_ratio: f32 = 0.5, in "ratio" rare, Range::Number(0.01, 0.95);
        "largest radius of a sphere over its distance: at 1 no spheres touch";
        "larger is faster: fewer spheres per cone";
        start_normal: f32 = 1.5, in "voxels" rare, Range::Number(0.0, 8.0);
        "start of cones along the normal";
        "no time; more: less self-light, less contact";
        start_along: f32 = 0.0, in "voxels" rare, Range::Number(0.0, 8.0);
        "start of cones along the cone";
        "no time; more: less self-light, less contact";
        ao_rate: f32 = 0.0, in "per metre" rare, Range::Number(0.0, 1e3);
        "rate of the exponential weight of visibility; 0: the visibility at the end of a cone";
        "little";
        ao_multiplies: AoMultiplies = AoMultiplies::Nothing, in "choice" rare, names!(AoMultiplies);
        "effect of weighted visibility: nothing (layer ao alone), or a factor of all light of a cone";
        "none";
    } + { ledger: Ledger }
}

switches! {
    /// Errors of the notes that are neither a choice nor a number above.
    "photons.ledger", "see docs/notes/photons.md";
    beer 0 "exponent of Beer's law, with composite = over: diameter/increment, or length/edge",
    steps 1 "spheres: h' = (h + hR)/(1 − R) for every R, or bounded",
    still 2 "where R or h is 0: the recursion stands still, or spheres are photons.least_step wide",
    color 3 "weight of colour: the opacity that was read, or that of the step",
    ao 4 "the exponential sum: visibility beyond each sphere, without start and end, or whole",
    mips 5 "mips: photons summed as they are, or as far as they are seen and fill no more than all",
    directions 6 "a texel of the octahedral map: at its middle, or its mean",
    seams 7 "filtering at the octahedral map's border: repeated, or folded",
    premultiplied 8 "light of the map: with its own opacity, or with that of the opacity volume",
}

impl Settings {
    /// The preset `photons-printed`: the formulas of the notes, where they can run.
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
pub const KEYS: &[&[Key]] = &[Settings::KEYS, Ledger::KEYS];
