//! The ledger of the notes: what they print or leave open, what stands here instead, and how each is measured.
//!
//! Each row is switched on top of the preset `photons`.

use crate::gi::ledger::Effect::{Fixed, Measured};
use crate::gi::ledger::Row;

/// What stands above the rows, Markdown.
pub const HEAD: &str = "\
The method `photons` follows a set of notes, \"VCT (Voxel Cone Tracing)\", that derive voxel cone tracing from photon mapping: a \
voxel holds one photon, and a cone of diameter D finds the radiance 1/D² · Σ BRDF · E · v² of the photons that it meets, where v is a \
voxel's edge. The notes rest on Jensen (\"Realistic Image Synthesis Using Photon Mapping\", 2001) and Hachisuka (\"High-Quality Global \
Illumination Rendering Using Rasterization\", GPU Gems 2, 2005) for photons; on Crassin, Neyret, Sainz, Green and Eisemann \
(\"Interactive Indirect Illumination Using Voxel Cone Tracing\", 2011) for voxels and cones; on Takeshige (\"The Basics of GPU \
Voxelization\", 2015) for voxelisation with several samples per pixel; on Dunn (\"Transparency (or Translucency) Rendering\", 2014) for \
premultiplied opacity; on Colbert and Křivánek (\"GPU-Based Importance Sampling\", GPU Gems 3, 2007) for the cones' directions and \
widths; and on Wächter and Binder (\"A Fast and Robust Method for Avoiding Self-Intersection\", Ray Tracing Gems, 2019) for where \
cones start.

Below is where the program does as the notes print, what of them is wrong, and what they leave open. Every row that changes an \
image is a setting, measured on top of the preset `photons`. The preset `photons-printed` has all of these as printed; where the notes \
leave something open (P12, P14, P18), it is as `photons`. Tests show that the printed form fails and the right one passes: \
`tests/device/functions_photons.rs` for formulas, `tests/device/passes_photons.rs` for passes.
";

/// Composited with \"over\", as the notes do.
const OVER: &[&str] = &["photons.composite=over"];
/// A cone wider than 45°.
const ONE: &[&str] = &["photons.diffuse=1", "image.interleave=1"];
/// Where visibility is weighted, it shows.
const WEIGHTED: &[&str] = &["photons.ao_rate=0.5", "photons.ao_multiplies=light"];

/// The rows, in the order of the notes' parts.
pub const ROWS: &[Row] = &[
    Row {
        id: "P1",
        printed: "Beer's law with the exponent diameter/increment",
        right: "the notes' own proof gives the inverse: length over the edge whose opacity was read. 1 − A = exp(−σ·length) and \
                1 − α = exp(−σ·edge), so 1 − A = (1 − α)^(length/edge)",
        effect: Measured { right: OVER, printed: &["photons.ledger.beer=printed"] },
    },
    Row {
        id: "P2",
        printed: "spheres h' = (h + hR)/(1 − R) for cones of every width",
        right: "bounded: at R ≥ 1, half angles from 45°, no sphere touches the last one (every cone at N = 1), and Ω = 2π has an infinite \
                R. Here R ≤ ½ cos θ, so that filtering, which reaches as far as a sphere is wide, stays off the plane that the cone leaves",
        effect: Measured { right: ONE, printed: &["photons.ledger.steps=printed"] },
    },
    Row {
        id: "P3",
        printed: "the same for every h and R: where h or R is 0, h' is h. The first h is not said",
        right: "a sphere is at least `photons.least_step` voxels wide; its length is its own extent, the exponent's edge that of the level \
                read. As printed a cone of R = 0 stands still beside its apex and finds nothing: smooth mirrors and glass are black in a \
                closed room. The first sphere is one of least width in both forms, since from h = 0 no cone would find anything",
        effect: Measured { right: &[], printed: &["photons.ledger.still=printed"] },
    },
    Row {
        id: "P4",
        printed: "radiance 1/D² · Σ BRDF · E · v² of the photons that a cone of diameter D meets",
        right: "the notes' formula, level by level: a level holds Σ BRDF · E · v² over its own face, and a cone reads the level whose edge \
                is D. A plane gives what it sends at every level and between them. Interpolated between levels are these quotients, of \
                which the notes say nothing: sums interpolated before they are divided would give a plane up to 1.26 times its light, and \
                `photons-printed` 1.62 of the indirect light of `cornell-point` instead of 1.04. A cone narrower than a voxel reads a whole \
                one: D is at least v",
        effect: Fixed,
    },
    Row {
        id: "P5",
        printed: "colour is weighted by the opacity that was read, visibility by Beer's",
        right: "both by the step's: else short steps count a colour whole each time",
        effect: Measured { right: &[], printed: &["photons.ledger.color=printed"] },
    },
    Row {
        id: "P19",
        printed: "the premultiplied value, BRDF · E · opacity, counts as it is stored",
        right: "divided by the opacity that the map holds beside it, direction by direction, and multiplied by the opacity that the step \
                meets (P9): a step shows as much of a wall as it hides, which sixteen directions alone say too coarsely",
        effect: Measured { right: &[], printed: &["photons.ledger.premultiplied=printed"] },
    },
    Row {
        id: "P6",
        printed: "\"filtering\", without a word on how. P4 asks for the sum of photons; their opacity is stored with them, premultiplied, and \
                  so is filtered alike: v²/D² · Σ opacity, cut at 1 where it is read",
        right: "these sums, but for two things: opacity is cut at 1 at every level, and its colour with it; and photons behind others of \
                the same cell count as far as these let through. Opacity by the mean of eight would halve a plane's with every level: \
                2.7 of the indirect light of `cornell-point` with `photons-printed`",
        effect: Measured { right: &[], printed: &["photons.ledger.mips=printed"] },
    },
    Row {
        id: "P7",
        printed: "sixteen outgoing directions: BRDF · E at each",
        right: "the mean over each texel's solid angle, scaled so that all of them send π times the radiance. The 4 × 4 map has eight \
                middles on z = 0, and texels of 0.68 and 0.89 sr: by middles a floor sends 0.77 of its light, a wall all of it",
        effect: Measured { right: &[], printed: &["photons.ledger.directions=printed"] },
    },
    Row {
        id: "P8",
        printed: "directions are \"reconstructed\" from the sixteen; hardware filtering repeats the map's border",
        right: "linear, folded at the border by hand",
        effect: Measured { right: &[], printed: &["photons.ledger.seams=printed"] },
    },
    Row {
        id: "P9",
        printed: "one opacity per voxel: its share of samples",
        right: "the area that faces the traveller: share · \\|nᵢ\\| / \\|n\\| along the dominant axis, per axis, to and fro. A slanting wall's \
                shares add up to \\|n·axis\\| along its normal, 0.58 at worst, and it hides what leaves its own front",
        effect: Measured { right: &[], printed: &["photons.opacity=samples"] },
    },
    Row {
        id: "P10",
        printed: "the under operator: spheres hide each other as if independent",
        right: "a sum: linear filtering spreads one wall over two spheres, a and 1 − a, of which \"under\" lets a(1 − a) through, up to a \
                quarter; no participating media is assumed, so that what one wall hides adds up to one wall",
        effect: Measured { right: &[], printed: OVER },
    },
    Row {
        id: "P11",
        printed: "nothing on backs",
        right: "dark backs are left out: on walls of zero thickness they would only darken what leaves their front",
        effect: Measured { right: &[], printed: &["photons.keep_backs=true"] },
    },
    Row {
        id: "P12",
        printed: "self-intersection: \"TODO\"",
        right: "1.5 voxels along the normal: a texel's filter reaches one voxel, and a surface lies up to half a voxel off its voxel's \
                middle. Offsets against rounding alone are a millionth of that",
        effect: Measured { right: &[], printed: &["photons.start_normal=0"] },
    },
    Row {
        id: "P13",
        printed: "ambient occlusion: Σ Vₖ (exp(−λhₖ₋₁) − exp(−λhₖ))",
        right: "V before the sphere, as for radiance; the interval before the first sphere; and the tail V·exp(−λh) after the last one. \
                In the open the printed sum misses both ends",
        effect: Measured { right: WEIGHTED, printed: &["photons.ledger.ao=printed"] },
    },
    Row {
        id: "P14",
        printed: "what ambient occlusion multiplies, and λ's unit, are not said",
        right: "λ per metre; it multiplies nothing, and is the layer `ao`. At λ = 0 that is what a cone sees in the end",
        effect: Measured { right: &[], printed: WEIGHTED },
    },
    Row {
        id: "P15",
        printed: "the map is looked up along the cone",
        right: "at minus its axis: what is sent towards the apex, as the notes' text says",
        effect: Fixed,
    },
    Row {
        id: "P16",
        printed: "several samples per pixel instead of conservative rasterisation; a geometry shader is not needed",
        right: "the notes' form: in one pass the vertex shader pulls the triangle, and each sample finds its voxel in depth, which lists the \
                triangle and counts the sample. `photons.voxelise=conservative` lists all voxels that a triangle touches, by the ground's \
                geometry shader, and counts samples in a second pass. An item without samples sends nothing and hides nothing: the boxes' \
                images are the same, the gallery's differs by 0.04 % at 64³ and 0.18 % at 32³, since on its metal balls such an item may be \
                lit for others that are alike. Both miss parts of triangles that lie between samples. Recording the scene's triangles takes \
                a geometry shader, with every method",
        effect: Fixed,
    },
    Row {
        id: "P17",
        printed: "several triangles of a voxel add up, in the order that the GPU takes them",
        right: "counts in integers, sums in fixed point: the same bits in every order",
        effect: Fixed,
    },
    Row {
        id: "P18",
        printed: "BRDF · E is evaluated for each of the sixteen directions, how is not said",
        right: "direct light of specular lobes goes where GGX sends it, by means over the quarters of texels, made whole; other light is \
                sent evenly. One lobe stands for all lights, wider by as much as they are apart. Against all of it sent evenly, `rel` is \
                0.393 from 0.441 in a box of rough metal (its coloured walls 0.239 from 0.285), 0.093 from 0.096 on the gallery's \
                diffuse surfaces, where that light is 8 % of the indirect one",
        effect: Fixed,
    },
];
