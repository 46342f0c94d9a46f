//! The table `[lpv]`.

use crate::settings::{Key, Range, auto, choices, names, table};

choices! {
    /// How a cell's light is spread over directions, two bands of spherical harmonics.
    Lobe {
        /// The clamped cosine, 1 + 2 cos θ in two bands. It is negative behind, where it is cut off, so that light is
        /// gained. A face's lobe has the integral 4π: a step passes on all of the light.
        Cosine = "cosine",
        /// The clamped cosine with the coefficients that the source's author published for each face, √π/2 and √(π/3):
        /// their integral is π, so that a step passes on a quarter of the light.
        CosinePi = "cosine-pi",
        /// As narrow as the light in the cell: one beam for each.
        Beam = "beam",
    }

    /// How light is blocked on its way from cell to cell.
    Occlusion {
        None = "none",
        /// Blocking area in two bands, half a cell off (Kaplanyan and Dachsbacher's geometry volume).
        Sh = "sh",
        /// Areas projected along the axes, side by side: a wall that fills a cell lets nothing pass.
        Sheets = "sheets",
    }

    /// Where the light of all steps is added up.
    Sum {
        /// Each step starts from the cell's own light: it grows with the number of steps.
        Own = "own",
        /// In a volume of its own, without the light that was injected: that is direct light.
        Apart = "apart",
    }

    /// Where the light that a surface sends starts.
    Injection {
        /// In the surface's own cell.
        Cell = "cell",
        /// In the cell in front of it.
        Front = "front",
    }

    /// How irradiance is read from what was added up.
    Apply {
        /// Two bands against the clamped cosine about the shading normal, half a cell off along it: a position and a
        /// perturbed normal are all that the source's page takes.
        Sh = "sh",
        /// Flux across a face that has the surface's orientation, a cell off it, where no such surface stands.
        Flux = "flux",
    }
}

table! {
    /// The defaults are the preset `lpv`.
    Settings as "lpv" {
        edge: u32 = 32, in "cells per edge", Range::PowerOfTwo(16, 64);
        "edge of the grids that light travels through; they have lists of their own";
        "propagation ×16 per doubling: eight times the cells, twice the steps";
        #[serde(with = "auto")]
        iterations: Option<u32> = None, in "steps" rare, Range::WholeOrAuto(1, 1024);
        "steps of propagation per bounce: light travels a cell a step; auto: as many as lpv.edge, under a sky twice as many";
        "propagation in proportion";
        cascades: u32 = 1, in "grids" rare, Range::Whole(1, 3);
        "nested grids: the coarsest is the base grid's cube, each finer one has half its side, about the camera";
        "every pass of the method, in proportion; lists are rebuilt when the camera leaves a cell";
        occlusion: Occlusion = Occlusion::Sheets, in "choice" rare, names!(Occlusion);
        "blocking between cells: none, areas in two bands (sh), or areas along the axes (sheets)";
        "little";
        lobe: Lobe = Lobe::Beam, in "choice" rare, names!(Lobe);
        "spread of a cell's light: the clamped cosine, the same with a quarter of the light (cosine-pi), or a beam as narrow as the light";
        "beam: a little slower, images of two texels a cell instead of four";
        sharpness: f32 = 0.5, in "cosine" rare, Range::Number(0.0, 0.95);
        "mean cosine of the narrowest beam: thirty directions cannot tell narrower ones apart";
        "none";
        sum: Sum = Sum::Apart, in "choice" rare, names!(Sum);
        "sum of the steps: in the travelling light, which grows with every step, or apart";
        "none";
        injection: Injection = Injection::Front, in "choice" rare, names!(Injection);
        "start of a surface's light: its own cell, or the cell in front of it";
        "front: six lists per cell instead of one";
        apply: Apply = Apply::Flux, in "choice" rare, names!(Apply);
        "irradiance: two bands against the cosine about the shading normal, or the flux through a face";
        "little";
    }
}

impl Settings {
    /// As the source's page and its author's other publications have it, where they say something.
    pub fn printed() -> Self {
        Self {
            lobe: Lobe::CosinePi,
            occlusion: Occlusion::Sh,
            sum: Sum::Own,
            injection: Injection::Cell,
            apply: Apply::Sh,
            iterations: Some(8),
            ..Self::default()
        }
    }

    /// Steps of propagation per bounce. A sky comes in from the border: in as many steps as cells half of its light has
    /// not reached the middle.
    pub fn steps(&self, sky: bool) -> u32 {
        self.iterations.unwrap_or(if sky { 2 * self.edge } else { self.edge })
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
