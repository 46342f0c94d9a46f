//! Settings of the method with a closed list of named values.

pub use crate::settings::Form;
use crate::settings::choices;

choices! {
    /// The talk's five sets of diffuse cones, and cosine-distributed ones.
    ConeSet {
        One = "1", Five = "5", SixA = "6a", SixB = "6b", Sixteen = "16",
        G1 = "g1", G2 = "g2", G4 = "g4", G6 = "g6", G8 = "g8", G12 = "g12", G16 = "g16", G24 = "g24", G32 = "g32",
        G48 = "g48", G64 = "g64", G128 = "g128",
    }

    /// The rule by which a voxel's triangles fill its seven values.
    Fill {
        /// All seven get the average of the shaded fronts, with alpha 1. This is one reading of the slides.
        Uniform = "uniform",
        /// Each side of a triangle contributes to the faces that it looks at, weighted by |n|.
        Facing = "facing",
        /// As `facing`, with alpha as the clipped triangle's projected area over the face area of the voxel.
        Coverage = "coverage",
        /// As `coverage`, but sides without light do not block: backs of single-sided triangles, and dark backs of
        /// others.
        Sided = "sided",
        /// The front of a triangle contributes to the three faces that see it, weighted by |n|, and its back to none;
        /// sums are divided by the number of triangles. The later engine of the talk's author does this (PasVulkan,
        /// 2023).
        Front = "front",
    }

    /// The mix of the three directional volumes along a cone's direction d.
    Weights { D2 = "d2", Norm1 = "norm1", Abs = "abs", Extinction = "extinction" }

    /// The compositing of a cone's samples.
    Blend {
        /// Nearer samples hide farther ones.
        Over = "over",
        /// Alphas add up to at most 1: exact for a wall that is read with linear filtering, at any phase.
        Sum = "sum",
    }

    /// The talk's three maps from roughness to a cone's aperture (tangent of the half angle), and one fitted to GGX.
    RoughnessFit {
        /// The polynomial of the intro: 47.5° at roughness 1.
        Polynomial = "polynomial",
        /// The Phong-power fit: 41° at roughness 1.
        Power = "power",
        /// Linear in the angle: 67.5° at roughness 1.
        Linear = "linear",
        /// Half the width of GGX's lobe: 0.1° at roughness 0.03, 44° at roughness 1.
        Ggx = "ggx",
    }

    /// The wrap mode of a sampler; the talk does not state it.
    Wrap {
        Clamp = "clamp",
        /// OpenGL's default.
        Repeat = "repeat",
    }

    /// The implementation of passes over a volume; the image is the same.
    Passes {
        /// As in the talk: a fragment per voxel of the whole grid, a layer per slice; the second bounce voxelises
        /// again.
        Layered = "layered",
        /// A thread per list item, occupied voxel, or parent of one; the lists are kept.
        Cells = "cells",
    }
}

impl ConeSet {
    /// The number of directions of a cosine-distributed set; `None` for the talk's sets.
    pub fn cosine_count(self) -> Option<u32> {
        self.name().strip_prefix('g').and_then(|count| count.parse().ok())
    }
}
