//! The table `[lpv]`.

use serde::{Deserialize, Serialize};

use crate::settings::{Key, Range, auto, choices, key, names, rare};

choices! {
    /// How a cell's light is spread over directions, two bands of spherical harmonics.
    Lobe {
        /// The clamped cosine, 1 + 2 cos θ in two bands. It is negative behind, where it is cut off, so that light is gained. A
        /// face's lobe has the integral 4π: a step passes on all of the light.
        Cosine = "cosine",
        /// The same, each face's with the coefficients that the source's author published, √π/2 and √(π/3): their integral is π, so
        /// that a step passes on a quarter of the light.
        CosinePi = "cosine-pi",
        /// As narrow as the light in the cell: one beam for each.
        Beam = "beam",
    }
}

choices! {
    /// What blocks light on its way from cell to cell.
    Occlusion {
        None = "none",
        /// Blocking area in two bands, half a cell off (Kaplanyan and Dachsbacher's geometry volume).
        Sh = "sh",
        /// Areas projected along the axes, side by side: a wall that fills a cell lets nothing pass.
        Sheets = "sheets",
    }
}

choices! {
    /// Where the light of all steps is added up.
    Sum {
        /// Each step starts from the cell's own light: it grows with the number of steps.
        Own = "own",
        /// In a volume of its own, without the light that was injected: that is direct light.
        Apart = "apart",
    }
}

choices! {
    /// Where the light that a surface sends starts.
    Injection {
        /// In the surface's own cell.
        Cell = "cell",
        /// In the cell in front of it.
        Front = "front",
    }
}

choices! {
    /// How irradiance is read from what was added up.
    Apply {
        /// Two bands against the clamped cosine about the shading normal, half a cell off along it: a position and a perturbed normal
        /// are all that the source's page takes.
        Sh = "sh",
        /// What crosses a face that looks like the surface, a cell off it, where no such surface stands.
        Flux = "flux",
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Cells along the edge of each grid.
    pub edge: u32,
    /// Steps of propagation per bounce; absent: as many as cells along the edge, twice as many under a sky.
    #[serde(with = "auto")]
    pub iterations: Option<u32>,
    /// Nested grids about the camera.
    pub cascades: u32,
    pub lobe: Lobe,
    /// Mean cosine of the narrowest beam.
    pub sharpness: f32,
    pub occlusion: Occlusion,
    pub sum: Sum,
    pub injection: Injection,
    pub apply: Apply,
}

impl Default for Settings {
    /// The preset `lpv`.
    fn default() -> Self {
        Self {
            edge: 32,
            iterations: None,
            cascades: 1,
            lobe: Lobe::Beam,
            sharpness: 0.5,
            occlusion: Occlusion::Sheets,
            sum: Sum::Apart,
            injection: Injection::Front,
            apply: Apply::Flux,
        }
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

    /// Steps of propagation per bounce. A sky comes in from the border: in as many steps as cells half of its light has not reached
    /// the middle.
    pub fn steps(&self, sky: bool) -> u32 {
        self.iterations.unwrap_or(if sky { 2 * self.edge } else { self.edge })
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[&[
    key(
        "lpv.edge",
        "cells per edge",
        Range::PowerOfTwo(16, 64),
        "edge of the grids that light travels through; they have lists of their own",
        "propagation ×16 per doubling: eight times the cells, twice the steps",
    ),
    rare(key(
        "lpv.iterations",
        "steps",
        Range::WholeOrAuto(1, 1024),
        "steps of propagation per bounce: light travels a cell a step; auto: as many as lpv.edge, under a sky twice as many",
        "propagation in proportion",
    )),
    rare(key(
        "lpv.cascades",
        "grids",
        Range::Whole(1, 3),
        "nested grids: the coarsest is the base grid's cube, each finer one has half its side, about the camera",
        "every pass of the method, in proportion; lists are made anew when the camera leaves a cell",
    )),
    rare(key(
        "lpv.occlusion",
        "choice",
        names!(Occlusion),
        "what blocks light from cell to cell: nothing, blocking areas in two bands, or areas along the axes",
        "little",
    )),
    rare(key(
        "lpv.lobe",
        "choice",
        names!(Lobe),
        "how a cell's light is spread: the clamped cosine, cut off where it is negative, the same with faces of integral π, which send \
         on a quarter, or a beam as narrow as it is",
        "beam: a little slower, images of two texels a cell instead of four",
    )),
    rare(key(
        "lpv.sharpness",
        "cosine",
        Range::Number(0.0, 0.95),
        "mean cosine of the narrowest beam: thirty directions cannot tell narrower ones apart",
        "none",
    )),
    rare(key(
        "lpv.sum",
        "choice",
        names!(Sum),
        "where steps add up: in the light that travels, which grows with every step, or apart",
        "none",
    )),
    rare(key(
        "lpv.injection",
        "choice",
        names!(Injection),
        "where the light of a surface starts: in its own cell, or in the cell in front of it",
        "front: six lists per cell instead of one",
    )),
    rare(key(
        "lpv.apply",
        "choice",
        names!(Apply),
        "how irradiance is read: two bands against the cosine about the shading normal, or the flux that crosses a face",
        "little",
    )),
]];
