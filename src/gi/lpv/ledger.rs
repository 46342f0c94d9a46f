//! The ledger of light propagation: what the source's page prints or leaves open, what stands here instead, and how each is
//! measured, on top of the preset `lpv`.

use crate::gi::ledger::Effect::{Fixed, Measured, NeverRan};
use crate::gi::ledger::Row;

/// What stands above the rows, Markdown.
pub const HEAD: &str = "\
The method `lpv` follows a page of Doghramachi, \"Rasterized Voxel-Based Dynamic Global Illumination\" (GPU Pro 4), with listing 7.3, \
the propagation of virtual point lights; the steps around it are those of Kaplanyan and Dachsbacher, \"Cascaded Light Propagation \
Volumes for Real-Time Indirect Illumination\" (2010). Below is what the page prints that is wrong, and what it leaves open. The preset \
`lpv-printed` is the page's form, with eight steps, and the published steps where the page is silent. `tests/passes_lpv.rs` holds the \
steps against their twin and against numbers worked out by hand, and shows that the printed forms fail.
";

const LOBES: &[&str] = &["lpv.lobe=cosine"];

/// The rows, in the order of the passes.
pub const ROWS: &[Row] = &[
    Row {
        id: "L1",
        printed: "nothing on where a light starts; in its surface's own cell, it lights that surface and is blocked by it",
        right: "in the cell in front of it, along the normal's longest part",
        effect: Measured { right: &[], printed: &["lpv.injection=cell"] },
    },
    Row { id: "L2", printed: "declares `dirSH`, fills `result`", right: "one variable", effect: NeverRan },
    Row {
        id: "L3",
        printed: "the lobes of the faces are not shown; with Ω/4π, lobes of integral π keep a quarter of the light per step",
        right: "their integral is 4π",
        effect: Fixed,
    },
    Row {
        id: "L4",
        printed: "two bands, cut off where they are negative: a light gains 14 % in its first step, and of what a wall sends 19 of 20 \
                  parts come back to it across a room of 24 cells",
        right: "a beam per cell, as narrow as its light (`glsl/gi/lpv/beams.glsl`): nothing is gained, less than two thirds come back. \
                One direction for all colours; narrowest beams have a mean cosine of `lpv.sharpness`",
        effect: Measured { right: &[], printed: LOBES },
    },
    Row {
        id: "L5",
        printed: "every step's sum starts from the cell's own light: ×10⁵ in 32 steps",
        right: "added up apart, without the light that was injected, which is direct light",
        effect: Measured { right: &["lpv.lobe=cosine", "lpv.iterations=8"], printed: &["lpv.sum=own"] },
    },
    Row {
        id: "L6",
        printed: "occlusion is blocking area in two bands: a closed wall lets a quarter of what meets it pass, and blocks half of what goes along it",
        right: "areas along the axes, by the side that they look to: a closed wall lets nothing pass, whatever goes along it does",
        effect: Measured { right: LOBES, printed: &["lpv.occlusion=sh"] },
    },
    Row {
        id: "L7",
        printed: "the face that both cells share is found by comparing a distance with 0.5",
        right: "by its index",
        effect: Fixed,
    },
    Row {
        id: "L8",
        printed: "workgroups of 8³ threads, four times what Vulkan guarantees",
        right: "of 4³",
        effect: Fixed,
    },
    Row {
        id: "L9",
        printed: "the number of steps is not on the page; published programs take about 8",
        right: "as many as cells along the edge: light may cross the grid once; twice as many under a sky",
        effect: Measured { right: &[], printed: &["lpv.iterations=8"] },
    },
    Row {
        id: "L10",
        printed: "irradiance is two bands against the clamped cosine: an even light adds up to 1.5 times its irradiance, a cube's mean projected area",
        right: "the flux that crosses a face: right in even light, and what propagation conserves",
        effect: Measured { right: LOBES, printed: &["lpv.apply=sh"] },
    },
    Row {
        id: "L11",
        printed: "nothing on the grid's border",
        right: "light leaves there, and the sky comes in there, once. It diffuses: in a grid of 32³ the middle has 31 % of an open sky after \
                200 steps of even lobes, 74 % after 400",
        effect: Fixed,
    },
    Row {
        id: "L12",
        printed: "one grid",
        right: "up to three, nested about the camera (Kaplanyan and Dachsbacher); a finer grid takes in, at its border, what the coarser one \
                added up there. Measured: three against one",
        effect: Measured { right: &[], printed: &["lpv.cascades=3"] },
    },
    Row {
        id: "L13",
        printed: "one bounce",
        right: "a second one: surfaces are lit by what arrived and their light travels again; `bounces = all` goes on from the last frame's",
        effect: Measured { right: &[], printed: &["bounces=1"] },
    },
    Row {
        id: "L14",
        printed: "diffuse surfaces",
        right: "mirrors and glass see what was sent along six directions, nothing sharper",
        effect: Fixed,
    },
];
