//! The ledger of the notes: what they print or leave open, what stands here instead, and how each is measured.
//!
//! Each row is switched on top of the preset `photons`.

use crate::gi::ledger::Effect::{Fixed, Measured, NeverRan};
use crate::gi::ledger::Row;

/// What stands above the rows, Markdown.
pub const HEAD: &str = "\
The method `photons` follows a set of notes, \"VCT (Voxel Cone Tracing)\", that derive voxel cone tracing from photon mapping: a \
voxel is a photon, its radiance is BRDF · E · v²/D² for a cone of diameter D. Below is what the notes print that is wrong, and what \
they leave open. Every row that changes an image is a setting, measured on top of the preset `photons`; the preset `photons-printed` \
has them all as printed, where they can run. Tests show that the printed form fails and the right one passes: \
`tests/functions_photons.rs` for formulas, `tests/passes_photons.rs` for passes.
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
        printed: "nothing on h = 0 and R → 0, where the recursion stands still",
        right: "a sphere is at least `photons.least_step` voxels wide; its length is its own extent, the exponent's edge that of the level read",
        effect: NeverRan,
    },
    Row {
        id: "P4",
        printed: "radiance × VoxelSize²/ConeDiameter² at every step",
        right: "a photon's area is that of the level that is read: the factor is 1, and mips carry it (P6). With the base voxel's edge \
                light falls off with distance twice",
        effect: Measured { right: &[], printed: &["photons.ledger.factor=printed"] },
    },
    Row {
        id: "P5",
        printed: "colour is weighted by the opacity that was read, visibility by Beer's",
        right: "both by the step's: else short steps count a colour whole each time",
        effect: Measured { right: &[], printed: &["photons.ledger.color=printed"] },
    },
    Row {
        id: "P6",
        printed: "\"filtering\", without a word on how: the mean of eight children",
        right: "flux per area: a quarter of the children's sum, v²/D² level by level, capped at 1 with its colour; photons behind \
                others of the same cell count as far as these let through. The mean halves a plane's opacity with every level",
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
        printed: "a geometry shader is not needed",
        right: "neither is it here: the vertex shader pulls the triangle, a raster without attachments counts samples. Which voxels a \
                triangle touches is the ground's conservative list, of which samples reach a part",
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
