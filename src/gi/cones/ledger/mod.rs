//! The ledger: what the talk's listings print, what is right instead, and how much that changes an image.
//!
//! [`ROWS`] says it once; `twobounce ledger` measures each row and writes `docs/ledger.md` with [`page::document`].

pub mod page;

use crate::gi::ledger::Effect::{Fixed, Measured, NeverRan, NoImage};
use crate::gi::ledger::Row;

/// Edge of the grid that the rows are measured on: D19's numbers are for it.
pub const EDGE: u32 = 32;

/// The rows in the order of their numbers (D27 and D28 are other methods').
pub const ROWS: &[Row] = &[
    Row {
        id: "D1",
        printed: "the −x −y −z mips fetch the volumes of +x +y +z",
        right: "each fetches its own",
        effect: Measured { right: &[], printed: &["cones.ledger.d1=printed"] },
    },
    Row {
        id: "D2",
        printed: "−y, fourth column: v(1,0,1) + v(1,0,1)·(1 − v(1,1,1).a); alpha reaches 1.25",
        right: "v(1,1,1) + v(1,0,1)·(1 − v(1,1,1).a)",
        effect: Measured { right: &[], printed: &["cones.ledger.d2=printed"] },
    },
    Row { id: "D3", printed: "`voxelIndex` has 3 opening and 4 closing brackets", right: "balanced", effect: NeverRan },
    Row {
        id: "D4",
        printed: "`cond ? samplerA : samplerB`",
        right: "the fetched values are selected",
        effect: NeverRan,
    },
    Row { id: "D5", printed: "`#ifdef 0`", right: "`#if 0`: the weights that sum to 1", effect: NeverRan },
    Row {
        id: "D6",
        printed: "set 6a: the side cones are written about y; two point below the surface, one lies in it",
        right: "about z, as the axis",
        effect: Measured { right: &["cones.set=6a"], printed: &["cones.ledger.d6=printed"] },
    },
    Row {
        id: "D7",
        printed: "the rotation matrix is the transpose of Rodrigues'; it turns by the opposite angle, which for a random angle is no error",
        right: "transposed back",
        effect: Measured { right: &["cones.jitter=true"], printed: &["cones.ledger.d7=printed"] },
    },
    Row {
        id: "D8",
        printed: "the jitter's angle is a hash in [0,1) taken as radians: 57° at most",
        right: "a full turn",
        effect: Measured { right: &["cones.jitter=true"], printed: &["cones.ledger.d8=printed"] },
    },
    Row {
        id: "D9",
        printed: "both jitters read `tc`, which is not declared; the shadow cone's is unconditional, the diffuse one's stands under `#ifdef`",
        right: "a hash of integers: of the place and the time within the animation, so that a still has one image and a sequence turns",
        effect: NeverRan,
    },
    Row {
        id: "D10",
        printed: "cones end at √2 of the cube's edge",
        right: "where they leave the cube, √3 at most",
        effect: Measured { right: &[], printed: &["cones.ledger.d10=printed"] },
    },
    Row {
        id: "D11",
        printed: "no bounds test: beyond the cube the sampler's wrap decides, here `clamp` (S1)",
        right: "there is nothing beyond the cube",
        effect: Measured { right: &["cones.ledger.d10=printed"], printed: &["cones.ledger.d11=printed"] },
    },
    Row {
        id: "D12",
        printed: "the shadow cone takes steps of ⅓ uncorrected: alpha ½ counts as 0.875",
        right: "1 − (1 − a)^(step/edge)",
        effect: Measured { right: &[], printed: &["cones.ledger.d12=printed"] },
    },
    Row {
        id: "D13",
        printed: "shadow level log₂(diameter·N + 1), radiance level log₂(diameter·N)",
        right: "log₂(diameter·N) for both",
        effect: Measured { right: &[], printed: &["cones.ledger.d13=printed"] },
    },
    Row {
        id: "D14",
        printed: "`isInsideCube` is left out of the slides; that is no error",
        right: "a test against [0,1]³; here the exit distance, the same for cones that start inside",
        effect: NeverRan,
    },
    Row {
        id: "D15",
        printed: "shadow cones read the isotropic volume: a wall's alpha halves per mip",
        right: "directional alpha",
        effect: Measured { right: &[], printed: &["cones.ledger.d15=printed"] },
    },
    Row {
        id: "D16",
        printed: "starts 4.5 voxels out, no stop before the light's own voxels; 0/0 where light and surface meet",
        right: "the start is kept; ends 2 voxels before the light; guarded",
        effect: Measured { right: &[], printed: &["cones.start.shadow_end=0"] },
    },
    Row {
        id: "D17",
        printed: "diameter max(½/N, max(1/N, 2t)·s): the inner maximum holds a length against a ratio",
        right: "max(1/N, 2t·s)",
        effect: Measured { right: &[], printed: &["cones.ledger.d17=printed"] },
    },
    Row {
        id: "D18",
        printed: "loops end at alpha ≥ 1 only",
        right: "at 0.995, and after 2048 steps",
        effect: Measured { right: &[], printed: &["cones.ledger.d18=printed"] },
    },
    Row {
        id: "D19",
        printed: "the diffuse cones' offset of −0.01, which moves them and not their width, is a share of the cube: 0.32 voxels of 32, 2.56 of 256",
        right: "1.28 voxels of every grid, as of the talk's 128",
        effect: Measured { right: &[], printed: &["cones.ledger.d19=printed"] },
    },
    Row {
        id: "D20",
        printed: "the first diffuse sample lies 6.06 to 6.55 voxels away at 128³ (6.94 to 7.51 at 32³, by D19), 4 in radius: no near field",
        right: "kept in `corrected`: with its fill a nearer start meets the surface's own voxels; measured against 1 voxel along the normal and 1 along the cone",
        effect: Measured {
            right: &["cones.start.diffuse_normal=1", "cones.start.diffuse_along=1", "cones.start.diffuse_offset=0"],
            printed: &[
                "cones.start.diffuse_normal=3.828427",
                "cones.start.diffuse_along=4",
                "cones.start.diffuse_offset=-1.28",
            ],
        },
    },
    Row {
        id: "D21",
        printed: "diffuse, specular and refraction cones drop alpha: no sky",
        right: "the sky shines through what alpha they leave",
        effect: Measured { right: &["sky=0.3"], printed: &["cones.ledger.d21=printed"] },
    },
    Row {
        id: "D22",
        printed: "the tangent frame jumps along \\|n.y\\| = \\|n.z\\|",
        right: "one singular direction, −z",
        effect: Measured { right: &[], printed: &["cones.ledger.d22=printed"] },
    },
    Row {
        id: "D23",
        printed: "refraction starts outside the surface that it enters",
        right: "on the refracted side",
        effect: Measured { right: &[], printed: &["cones.ledger.d23=printed"] },
    },
    Row {
        id: "D24",
        printed: "a fixed 1/ior, no back face; with an index below 1 `refract()` can be 0, whose direction is undefined",
        right: "flipped by side; total reflection reflects; thin walls do not bend",
        effect: NoImage,
    },
    Row {
        id: "D25",
        printed: "three maps from roughness to aperture disagree: 47.5°, 41°, 67.5° at roughness 1",
        right: "all three by name; measured: `linear` against `polynomial`",
        effect: Measured { right: &["cones.roughness_fit=polynomial"], printed: &["cones.roughness_fit=linear"] },
    },
    Row {
        id: "D26",
        printed: "set 16: equal weights, no cosine",
        right: "weights ∝ cosine, normalised",
        effect: Measured { right: &["cones.set=16"], printed: &["cones.ledger.d26=printed"] },
    },
    Row {
        id: "D29",
        printed: "the second bounce repeats the identical voxelisation",
        right: "kept as printed; `cones.passes = cells` keeps the lists and gives the same bits",
        effect: Measured { right: &["cones.passes=cells"], printed: &["cones.passes=layered"] },
    },
    Row {
        id: "D30",
        printed: "the pixel shader tests the dilated triangle against the voxel: lists 2.2 times as long here, 1.006 times in a room of 34 triangles at 64³",
        right: "the triangle itself",
        effect: Measured { right: &[], printed: &["cones.ledger.d30=printed"] },
    },
];

/// What the slides leave open or do otherwise without an error: `printed` is what they say, `right` what is done here. Where
/// it is measured, `printed` is the other way.
pub const OPEN: &[Row] = &[
    Row {
        id: "S1",
        printed: "no sampler's wrap is stated; OpenGL's default repeats the cube",
        right: "`cones.wrap = clamp`: its edge voxels go on; measured: `repeat` against it",
        effect: Measured {
            right: &["cones.ledger.d10=printed", "cones.ledger.d11=printed"],
            printed: &["cones.wrap=repeat"],
        },
    },
    Row {
        id: "S2",
        printed: "where the volume stands is not said",
        right: "a cube about the scene, `grid.margin` = 2.5 voxels free on each side: a wall at the border lies in the middle of a voxel, not in a face that two layers share, and cones that start 2 voxels off it start inside. A margin of 2, measured here, moves the image more than any error of the listings does",
        effect: Measured { right: &[], printed: &["grid.margin=2"] },
    },
    Row {
        id: "S3",
        printed: "the first bounce knows of no volume, so that no cone shadows it",
        right: "the same; measured, with `lights.shadows = rays`: unshadowed against shadowed",
        effect: Measured {
            right: &["lights.shadows=rays", "cones.first_bounce_shadows=true"],
            printed: &["cones.first_bounce_shadows=false"],
        },
    },
    Row {
        id: "S4",
        printed: "every light's shadow cone has 5°",
        right: "the same; measured against `auto`, each light's own radius",
        effect: Measured {
            right: &["cones.shadow_half_angle=auto"],
            printed: &["cones.shadow_half_angle=5"],
        },
    },
    Row {
        id: "S5",
        printed: "the diffuse cones' jitter stands under `#ifdef`",
        right: "off in both presets; measured: on",
        effect: Measured { right: &[], printed: &["cones.jitter=true"] },
    },
    Row {
        id: "S6",
        printed: "level 0 is \"sum and average the color values\", seven targets are for \"multi-directional anisotropic voxel\"; how the \
                  average reaches the six directions, and what a two-sided triangle sends, is not said",
        right: "our reading, `cones.fill = uniform`: a triangle is shaded once, for its front, at its point nearest to the voxel's middle, and \
                all seven targets get the average. The author's later engine (PasVulkan, \
                `global_illumination_voxel_radiance_transfer.comp`) puts each triangle into the three directions that see its front, weighted \
                by \\|n\\|, and nothing behind it: `cones.fill = front`, measured here. [Both with both sets of cones](#two-fills-two-sets)",
        effect: Measured { right: &[], printed: &["cones.fill=front"] },
    },
    Row {
        id: "S7",
        printed: "voxels are shaded as the image is, whoever looks",
        right: "a voxel has no viewer: its specular cone follows the normal, and what it finds is sent evenly",
        effect: Fixed,
    },
    Row {
        id: "S8",
        printed: "refraction is a cone like the others",
        right: "in the image alone: what a voxel would transmit is left out of its colour and alpha",
        effect: Fixed,
    },
    Row {
        id: "S9",
        printed: "every triangle is recorded",
        right: "those without area are counted and dropped: they have no plane to be tested with",
        effect: Fixed,
    },
    Row {
        id: "S10",
        printed: "the algorithm works in world space",
        right: "triangles are recorded in voxels of the grid, so that a scene moved or scaled gives the same image",
        effect: Fixed,
    },
    Row {
        id: "S11",
        printed: "lists are as long as they get, in the order of the GPU",
        right: "sums in fixed point, the same in every order; buffers that were too small grow, and the frame repeats",
        effect: Fixed,
    },
    Row {
        id: "S13",
        printed: "specular and refraction cones take `maxDistance` from a caller that is not shown",
        right: "√2, the cut that the listing itself makes (D10)",
        effect: Fixed,
    },
    Row {
        id: "S12",
        printed: "nothing on occlusion, a sky or lamps that are sampled",
        right: "this project's, and so are the presets `cones`, `fast`, `balanced` and `accurate`",
        effect: Fixed,
    },
];

/// Choices that are neither right nor wrong, each against the preset `corrected`.
pub const CHOICES: &[&str] = &[
    "cones.fill=facing",
    "cones.fill=coverage",
    "cones.fill=sided",
    "cones.weights=norm1",
    "cones.weights=abs",
    "cones.weights=extinction",
    "cones.set=1",
    "cones.set=6a",
    "cones.set=6b",
    "cones.set=16",
    "cones.roughness_fit=power",
    "cones.shadow_jitter=false",
    "bounces=1",
    "lights.shadows=none",
    "lights.shadows=rays",
];

/// Scenes whose indirect light is measured with both readings of the fill and both sets: nothing was tuned on the last one.
pub const FILL_SCENES: &[&str] = &["assets/cornell-point.glb", "assets/cornell-area.glb", "assets/gallery.glb", "assets/stairs.glb"];
/// Further settings of that table, on top of `corrected` on equal terms.
pub const FILL_SETTINGS: &[&[&str]] = &[
    &["cones.set=5", "cones.fill=uniform"],
    &["cones.set=5", "cones.fill=front"],
    &["cones.set=5", "cones.fill=front", "cones.weights=abs"],
    &["cones.set=16", "cones.fill=uniform"],
    &["cones.set=16", "cones.fill=front"],
    &["cones.set=16", "cones.fill=front", "cones.weights=abs"],
];
/// Edge of the grid of that table.
pub const FILL_EDGE: u32 = 64;
/// Noise of the path-traced images that it is measured against, as a share.
pub const FILL_NOISE: f64 = 0.025;

/// Fills on which furnaces are measured, each with the settings that it is made for.
pub const FURNACE_FILLS: &[(&str, &[&str])] = &[
    ("uniform", &["cones.fill=uniform"]),
    ("facing", &["cones.fill=facing"]),
    ("coverage", &["cones.fill=coverage"]),
    ("front", &["cones.fill=front"]),
    (
        "sided",
        &[
            "cones.fill=sided",
            "cones.weights=abs",
            "cones.blend=sum",
            "cones.start.diffuse_normal=1",
            "cones.start.diffuse_along=0.5",
            "cones.start.diffuse_offset=0",
            "cones.set=g16",
        ],
    ),
];
/// Albedo, and whether a block stands inside.
pub const FURNACE_ROOMS: &[(f32, bool)] = &[(0.5, false), (0.5, true), (0.8, false), (0.8, true)];
/// Grids on which furnaces are measured.
pub const FURNACE_EDGES: &[u32] = &[32, 128];
