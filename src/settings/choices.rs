//! The settings that are one of a few words.

use serde::{Deserialize, Serialize};

/// Closed lists of named choices: parsed from and printed as the names used in files and flags.
macro_rules! choices {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum $name { $($(#[$vdoc])* #[serde(rename = $text)] $variant),+ }
        impl $name {
            /// Every choice, in the order of the docs.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];
            /// The name used in files and flags.
            pub const fn name(self) -> &'static str { match self { $(Self::$variant => $text),+ } }
        }
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { f.write_str(self.name()) }
        }
    };
}

choices! {
    /// The talk's five sets of diffuse cones, and cosine-distributed ones.
    ConeSet {
        One = "1", Five = "5", SixA = "6a", SixB = "6b", Sixteen = "16",
        G1 = "g1", G2 = "g2", G4 = "g4", G6 = "g6", G8 = "g8", G12 = "g12", G16 = "g16", G24 = "g24", G32 = "g32",
        G48 = "g48", G64 = "g64", G128 = "g128",
    }
}
choices! {
    /// How much indirect light there is.
    Bounces {
        One = "1", Two = "2",
        /// The last frame's second volume lights the first: two more bounces per frame.
        All = "all",
    }
}
choices! {
    /// How often the light of point, spot and directional lights is looked for.
    DirectLight {
        /// At every sample: shadows' edges are anti-aliased.
        Samples = "samples",
        /// Once per pixel and surface.
        Pixels = "pixels",
    }
}
choices! {
    /// At how many pixels diffuse light is gathered.
    GatherResolution { Full = "full", Half = "half", Quarter = "quarter" }
}
choices! {
    /// What looks along a direction: a diffuse set's, a mirror's, or the one behind glass.
    Gather {
        /// Cones through the volume.
        Cones = "cones",
        /// Rays that find the triangle exactly and read the volume where they hit.
        Rays = "rays",
    }
}
choices! {
    /// How a voxel's triangles fill its seven level-0 targets.
    Fill {
        /// The shaded average in all seven, alpha 1 (what the printed mips imply).
        Uniform = "uniform",
        /// Each side goes to the faces that look at it, weighted by |n|.
        Facing = "facing",
        /// Alpha is the clipped triangle's projected area over the voxel's face area.
        Coverage = "coverage",
        /// As coverage, but sides that send nothing do not block: backs of single-sided triangles, dark backs of others.
        Sided = "sided",
    }
}
choices! {
    /// How three directional volumes are mixed along a cone's direction d.
    Weights { D2 = "d2", Norm1 = "norm1", Abs = "abs", Extinction = "extinction" }
}
choices! {
    /// How a cone's samples are composited.
    Blend {
        /// Front hides back.
        Over = "over",
        /// Alphas add up to 1: exact for a wall read with linear filtering, at any phase.
        Sum = "sum",
    }
}
choices! {
    /// How lights are tested for occlusion.
    Shadows {
        None = "none",
        /// A narrow cone to the light, through the volume: soft, leaky, as in the talk.
        Cones = "cones",
        /// A ray that walks the voxels and tests the listed triangles: hard, exact.
        Rays = "rays",
    }
}
choices! {
    /// How emissive surfaces light the scene.
    Emitters {
        /// Through cones only, as in the talk: a lamp's own light is the first gather.
        Cones = "cones",
        /// As area lights, shadowed by exact rays; cones do not see their emission again.
        Sampled = "sampled",
    }
}
choices! {
    /// Whether the second bounce voxelises again, as the talk does, or keeps the first bounce's lists.
    Lists { Rebuild = "rebuild", Reuse = "reuse" }
}
choices! {
    /// Where the second bounce's voxels have their direct light from.
    ShadeDirect {
        /// Every bounce finds it, as in the talk.
        Again = "again",
        /// The first bounce's is kept, where it is the same.
        Kept = "kept",
    }
}
choices! {
    /// Which of a voxel's triangles are lit.
    ShadeItems {
        /// Each for itself, as in the talk.
        Each = "each",
        /// One for all that have one material and face alike.
        Alike = "alike",
    }
}
choices! {
    /// What a pass over a volume goes through; the volume is the same, unless only one form lights alike triangles as one.
    Work {
        /// A fragment per voxel of the whole grid, as in the talk.
        Raster = "raster",
        /// A thread per occupied voxel, or parent of one, from lists.
        Cells = "cells",
    }
}
choices! {
    /// What is kept of the last frame; the image is the same.
    Reuse {
        /// Nothing: every frame is voxelised and lit anew.
        None = "none",
        /// The lists while nothing moves, and the volumes while no light changes either: cameras may move.
        Still = "still",
    }
}
choices! {
    /// The talk's three maps from roughness to a cone's aperture (tangent of the half angle), and one of GGX.
    RoughnessFit {
        /// The polynomial that the intro used: 47.5° at roughness 1.
        Polynomial = "polynomial",
        /// The Phong-power fit: 41° at roughness 1.
        Power = "power",
        /// Linear in the angle: 67.5° at roughness 1.
        Linear = "linear",
        /// As wide as half of GGX's lobe: 0.1° at roughness 0.03, 44° at roughness 1.
        Ggx = "ggx",
    }
}
choices! {
    /// One row of the ledger: as the talk prints it, or as it should be.
    Form { Printed = "printed", Right = "right" }
}

impl ConeSet {
    /// The number of directions of a cosine-distributed set; `None` for the talk's own.
    pub fn cosine_count(self) -> Option<u32> {
        self.name().strip_prefix('g').and_then(|count| count.parse().ok())
    }
}

impl GatherResolution {
    /// Pixels of the image per gathered one, along each side.
    pub fn scale(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

impl Bounces {
    /// Volumes that are filled.
    pub fn volumes(self) -> u32 {
        if self == Self::One { 1 } else { 2 }
    }
}
