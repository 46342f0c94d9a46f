//! The settings of the method that are one of a few words.

pub use crate::settings::Form;
use crate::settings::choices;

choices! {
    /// The talk's five sets of diffuse cones, and cosine-distributed ones.
    ConeSet {
        One = "1", Five = "5", SixA = "6a", SixB = "6b", Sixteen = "16",
        G1 = "g1", G2 = "g2", G4 = "g4", G6 = "g6", G8 = "g8", G12 = "g12", G16 = "g16", G24 = "g24", G32 = "g32",
        G48 = "g48", G64 = "g64", G128 = "g128",
    }

    /// How a voxel's triangles fill its seven level-0 targets.
    Fill {
        /// The average of the shaded fronts in all seven, alpha 1. The slides can be read so.
        Uniform = "uniform",
        /// Each side of a triangle goes to the faces that look at it, weighted by |n|.
        Facing = "facing",
        /// Alpha is the clipped triangle's projected area over the voxel's face area.
        Coverage = "coverage",
        /// As coverage, but sides that send nothing do not block: backs of single-sided triangles, dark backs of
        /// others.
        Sided = "sided",
        /// The front of a triangle goes to the three faces that see it, weighted by |n|, and nothing behind it; sums
        /// over the number of triangles. The author's later engine does so (PasVulkan, 2023).
        Front = "front",
    }

    /// How three directional volumes are mixed along a cone's direction d.
    Weights { D2 = "d2", Norm1 = "norm1", Abs = "abs", Extinction = "extinction" }

    /// How a cone's samples are composited.
    Blend {
        /// Front hides back.
        Over = "over",
        /// Alphas add up to 1: exact for a wall read with linear filtering, at any phase.
        Sum = "sum",
    }

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

    /// A sampler's wrap; the talk does not state it.
    Wrap {
        Clamp = "clamp",
        /// OpenGL's default.
        Repeat = "repeat",
    }

    /// How a pass goes through a volume: the image is the same.
    Passes {
        /// As in the talk: a fragment per voxel of the whole grid, a layer per slice; the second bounce voxelises
        /// again.
        Layered = "layered",
        /// A thread per list item, occupied voxel, or parent of one; the lists are kept.
        Cells = "cells",
    }
}

impl ConeSet {
    /// The number of directions of a cosine-distributed set; `None` for the talk's own.
    pub fn cosine_count(self) -> Option<u32> {
        self.name().strip_prefix('g').and_then(|count| count.parse().ok())
    }
}
