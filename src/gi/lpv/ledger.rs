//! The ledger of light propagation: what the source's page shows, what it does not, what stands here instead, and how each is
//! measured, on top of the preset `lpv`.

use crate::gi::ledger::Effect::{Fixed, Measured, NeverRan};
use crate::gi::ledger::Row;

/// What stands above the rows, Markdown.
pub const HEAD: &str = "\
The method `lpv` follows a page of Doghramachi, \"Rasterized Voxel-Based Dynamic Global Illumination\" (GPU Pro 4): the second half of \
listing 7.3, the propagation of virtual point lights, and the first paragraph of section 7.3.4, which applies them. The second column \
says what this page shows. The third says what it does not show: what the book and its author's other publications have, what Kaplanyan \
and Dachsbacher have (\"Cascaded Light Propagation Volumes for Real-Time Indirect Illumination\", 2010), or how we read what is open. The \
preset `lpv-printed` is both columns together, with eight steps. `tests/device/passes_lpv.rs` holds the steps against the listing, their twin and \
numbers worked out by hand; `tests/device/lpv.rs` holds the image against the page's inputs and textures.
";

/// Lobes that pass on all of their light.
const LOBES: &[&str] = &["lpv.lobe=cosine"];

/// The rows, in the order of the passes, then what is the same in both forms.
pub const ROWS: &[Row] = &[
    Row {
        id: "L1",
        printed: "– \
                  | where a light starts: in its surface's own cell, where it lights that surface and is blocked by it",
        right: "in the cell in front of it, along the normal's longest part",
        effect: Measured { right: &[], printed: &["lpv.injection=cell"] },
    },
    Row {
        id: "L2",
        printed: "declares `dirSH`, fills `result` \
                  | –",
        right: "one variable",
        effect: NeverRan,
    },
    Row {
        id: "L3",
        printed: "a face sends on its flux times `faceCoeffs[j]`; the flux is the intensity times Ω/4π \
                  | the coefficients: their author published .8862 and, along the face's direction, 1.0233. A lobe of these has the integral π, so \
                  that a step passes on a quarter of the light",
        right: "lobes of integral 4π: a step passes on all of the light",
        effect: Measured { right: LOBES, printed: &["lpv.lobe=cosine-pi"] },
    },
    Row {
        id: "L4",
        printed: "two bands, cut off where they are negative: in its first step a light sends 14 % more than it has. 95 % of a wall's light ends \
                  on that wall in a room 24 cells wide, in lobes of integral 4π \
                  | –",
        right: "a beam per cell, as narrow as its light (`glsl/gi/lpv/beams.glsl`): nothing is gained, less than two thirds end there. \
                One direction for all colours; narrowest beams have a mean cosine of `lpv.sharpness`",
        effect: Measured { right: &[], printed: LOBES },
    },
    Row {
        id: "L5",
        printed: "the sum of a step is the light that travels in the next one \
                  | every step's sum starts from the cell's own light (in the book): what travels grows by a quarter a step, 6.6 times in eight steps",
        right: "added up apart, without the light that was injected, which is direct light",
        effect: Measured { right: &["lpv.lobe=cosine-pi", "lpv.iterations=8"], printed: &["lpv.sum=own"] },
    },
    Row {
        id: "L6",
        printed: "light is blocked by two bands against its direction \
                  | what the bands hold: blocking area, half a cell off (Kaplanyan and Dachsbacher). A closed wall lets a quarter of what meets \
                  it pass, and blocks half of what goes along it",
        right: "areas along the axes, by the side that they look to: a closed wall lets nothing pass, whatever goes along it does",
        effect: Measured { right: LOBES, printed: &["lpv.occlusion=sh"] },
    },
    Row {
        id: "L7",
        printed: "the face that both cells share is found by comparing a distance with 0.5 \
                  | –",
        right: "by its index",
        effect: Fixed,
    },
    Row {
        id: "L8",
        printed: "4³ workgroups for 32³ cells: of 8³ threads each, four times what Vulkan guarantees \
                  | –",
        right: "of 4³ threads each",
        effect: Fixed,
    },
    Row {
        id: "L9",
        printed: "– \
                  | the number of steps; published programs take about 8",
        right: "as many as cells along the edge: light may cross the grid once; twice as many under a sky",
        effect: Measured { right: &[], printed: &["lpv.iterations=8"] },
    },
    Row {
        id: "L10",
        printed: "– \
                  | irradiance is two bands against the clamped cosine: an even light adds up to 1.5 times its irradiance, a cube's mean projected \
                  area",
        right: "the flux that crosses a face: right in even light, and what propagation conserves",
        effect: Measured { right: LOBES, printed: &["lpv.apply=sh"] },
    },
    Row {
        id: "L11",
        printed: "– \
                  | what happens at the grid's border",
        right: "light leaves there, and the sky comes in there, once. It diffuses: in even lobes, under an open sky the centre of a 32³ grid has \
                reached 31 % after 200 steps, 74 % after 400",
        effect: Fixed,
    },
    Row {
        id: "L12",
        printed: "a grid of 32³ cells \
                  | whether several are nested",
        right: "up to three, nested about the camera (Kaplanyan and Dachsbacher); a finer grid takes in, at its border, what the coarser one \
                added up there. Measured: three against one",
        effect: Measured { right: &[], printed: &["lpv.cascades=3"] },
    },
    Row {
        id: "L13",
        printed: "– \
                  | a second bounce",
        right: "a second one: surfaces are lit by what arrived and their light travels again; `bounces = all` goes on from the last frame's",
        effect: Measured { right: &[], printed: &["bounces=1"] },
    },
    Row {
        id: "L14",
        printed: "– \
                  | surfaces that are not diffuse",
        right: "mirrors and glass see what was sent along six directions, nothing sharper",
        effect: Fixed,
    },
    Row {
        id: "L15",
        printed: "light is applied to each visible pixel, from a depth buffer and a buffer of perturbed normals (7.3.4) \
                  | the formula: light that travels against the perturbed normal, half a cell off the surface along that normal",
        right: "`lpv.apply=sh` takes the same: with the layers `depth` and `normal` of the image, the sums give its indirect light to four \
                digits, the rounding of single floats. `flux` looks up a cell off the facet",
        effect: Fixed,
    },
    Row {
        id: "L16",
        printed: "three textures, one a colour, with four coefficients each \
                  | –",
        right: "four textures, one a coefficient, each with three colours and the sky's share: the same numbers, times constants",
        effect: Fixed,
    },
    Row {
        id: "L17",
        printed: "every step is blocked, where `USE_OCCLUSION` is set \
                  | whether it is set for the first step",
        right: "with `lpv.occlusion=sh` the first step is not blocked, or a light would be by its own surface (Kaplanyan and Dachsbacher); with \
                `sheets`, where it starts in front of its surface, every step is",
        effect: Fixed,
    },
];
