//! The settings `[lpv]` of light propagation volumes.

use crate::settings::{Key, Range, auto, choices, names, table};

choices! {
    /// The distribution of a cell's light over directions, in two bands of spherical harmonics.
    Lobe {
        /// The clamped cosine, 1 + 2 cos θ in two bands. Negative values behind are clamped, which adds light. The lobe
        /// of a face has the integral 4π, so that a step passes on all of the light.
        Cosine = "cosine",
        /// The clamped cosine with the coefficients that the source's author published for each face, √π/2 and √(π/3).
        /// Their integral is π, so that a step passes on a quarter of the light.
        CosinePi = "cosine-pi",
        /// One beam per cell, as narrow as the light in it.
        Beam = "beam",
    }

    /// Blocking of light between cells.
    Occlusion {
        None = "none",
        /// Blocking area in two bands, at positions shifted by half a cell (Kaplanyan and Dachsbacher's geometry
        /// volume).
        Sh = "sh",
        /// Areas projected along the axes and added: a wall that fills a cell blocks all light.
        Sheets = "sheets",
    }

    /// Where the light of all steps is summed.
    Sum {
        /// In the travelling light itself: it grows with the number of steps.
        Own = "own",
        /// In a separate volume, without the injected light, which is direct light.
        Apart = "apart",
    }

    /// Where the light of a surface starts.
    Injection {
        /// In the cell of the surface.
        Cell = "cell",
        /// In the cell in front of the surface.
        Front = "front",
    }

    /// The way in which irradiance is computed from the summed light.
    Apply {
        /// Two bands times the clamped cosine about the shading normal, at a position shifted by half a cell along it:
        /// the source's page uses only a position and a perturbed normal.
        Sh = "sh",
        /// The flux across a face with the surface's orientation, one cell away, in cells without such a surface.
        Flux = "flux",
    }
}

table! {
    /// The defaults are those of the preset `lpv`.
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
    /// The form of the source's page and its author's other publications, where they specify one.
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

    /// Steps of propagation per bounce. The light of a sky enters at the border: after as many steps as cells, half of
    /// it has not reached the middle.
    pub fn steps(&self, sky: bool) -> u32 {
        self.iterations.unwrap_or(if sky { 2 * self.edge } else { self.edge })
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
