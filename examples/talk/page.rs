//! `docs/talk.md`: the talk's slides in their order; for each statement where it stands here and what differs.

use std::fmt::Write as _;

/// One or more slides under a title of the talk.
pub struct Slide {
    pub title: &'static str,
    pub statements: &'static [Statement],
    /// Files in `docs/talk/`, and what they show.
    pub pictures: &'static [(&'static str, &'static str)],
}

/// What slides say, where that is here and how it differs, and the rows of the ledger about it.
pub struct Statement(pub &'static str, pub &'static str, pub &'static [&'static str]);

use Statement as S;

pub const SLIDES: &[Slide] = &[
    Slide {
        title: "How to use Voxel Cone Tracing with two bounces for everything",
        statements: &[S(
            "one technique for all light, not for global illumination alone",
            "the preset `printed`: diffuse light, reflections, refraction and shadows are cones through the same volume \
             (`glsl/gi/cones/look_up.glsl`). Direct light of point, spot and directional lights is evaluated, and shadowed by a cone",
            &[],
        )],
        pictures: &[("image.png", "the gallery with the preset `printed`, 128³ voxels, two bounces")],
    },
    Slide {
        title: "What is Voxel Cone Tracing? (three slides)",
        statements: &[
            S(
                "diffuse light: several cones about the normal, as wide as their number asks",
                "`glsl/gi/cones/cone_set.glsl`; the setting `cones.set` has the slides' five sets by name (1, 5, 6a, 6b, 16) and this \
                 project's own (g1 … g128)",
                &["D6", "D26"],
            ),
            S(
                "reflections, refraction, shadows: one cone, as wide as the roughness (or the light) asks",
                "`glsl/gi/cones/look_up.glsl`, widths from `glsl/gi/cones/roughness.glsl`",
                &["D25"],
            ),
            S(
                "a march through a volume that starts a little away, with steps that grow with the cone's width, and a mip level from that width",
                "`trace_cone` in `glsl/gi/cones/cone.glsl`; starts are settings, `cones.start.diffuse_normal` and its like",
                &["D17", "D19", "D20"],
            ),
            S(
                "each look-up gives light and occlusion, composited front to back, until nothing shines through or it is far enough",
                "the same loop; `cones.blend = over` is the slides', `sum` this project's",
                &["D10", "D18"],
            ),
            S(
                "ray tracing of a simplified scene: part coverage instead of hit or miss, no noise, level of detail; in return less precise, \
                 and light leaks",
                "[the study](study/README.md) measures every setting against a path tracer. One statement does not hold for the listings: \
                 the shadow cone's start is jittered, so `printed` has noise, the same in every image of one moment",
                &[],
            ),
        ],
        pictures: &[],
    },
    Slide {
        title: "Voxel Cone Tracing: the 64k intro's algorithm",
        statements: &[
            S(
                "it works in the world, not on the screen",
                "so it does here: lists and volumes depend on no camera, and are kept while only the camera moves (`src/frame.rs`). Positions \
                 are recorded in voxels of the grid, not in world units (`src/ground/grid.rs`)",
                &[],
            ),
            S(
                "propagation and mips are one step",
                "we read \"propagate\" as the directional mips; the slides say no more. Each level holds, per direction of travel, what the finer \
                 level lets through (`src/gi/cones/mips.rs`)",
                &[],
            ),
            S(
                "reset, record, voxelise and shrink once without and once with the light of the bounce before, render",
                "`src/frame.rs` up to the lists, `update` in `src/gi/cones/mod.rs` from the first volume to the second one's mips, \
                 `src/ground/image/mod.rs` for the image",
                &["D29"],
            ),
        ],
        pictures: &[],
    },
    Slide {
        title: "Data resources",
        statements: &[
            S(
                "two volumes, one per bounce, of 128³ texels with mips, each of seven RGBA16F targets: six directions of travel, and one for all",
                "`src/ground/faces.rs`: `voxels` is 16 to 256, 128 by default; as many volumes as `bounces` says",
                &[],
            ),
            S(
                "a front view of 128×128 in any format, without mips: an empty screen to record in front of",
                "`src/ground/record.rs`, RGBA8, 128×128; nothing is ever written to it",
                &[],
            ),
            S(
                "buffers: globals, triangles, list items, voxels, voxel cells",
                "the same five, by these names (`src/ground/lists.rs`; the triangles in `src/ground/mod.rs`): counters; what was recorded; \
                 pairs of triangle and next item; each voxel's first item; the occupied voxels. Buffers that are too small grow, and the \
                 frame is repeated",
                &["S11"],
            ),
        ],
        pictures: &[],
    },
    Slide {
        title: "Reset buffer counters",
        statements: &[S(
            "three counters start at nothing: triangles, list items, voxel cells",
            "`src/ground/reset.rs`, fills without a shader; the heads of all lists are emptied there too",
            &[],
        )],
        pictures: &[],
    },
    Slide {
        title: "Record geometry triangles into a buffer",
        statements: &[
            S("an ordinary vertex shader", "`glsl/ground/record.vert`", &[]),
            S(
                "a geometry shader that appends every three vertices as one triangle, with positions, normals, texture coordinates, material",
                "`glsl/ground/record.geom`; tangents, a second set of coordinates and vertex colours come along. Triangles without area are \
                 counted and dropped, and positions are in voxels",
                &["S2", "S9", "S10"],
            ),
            S(
                "a pixel shader that does nothing; colour and depth writes are off",
                "`glsl/ground/record.frag`; colour writes are masked, there is no depth target",
                &[],
            ),
        ],
        pictures: &[(
            "front-view.png",
            "what was recorded, seen through the volume's front along −z and coloured by the normals: drawn from the triangle buffer \
             afterwards, since the front view itself stays empty; triangles that turn away are left out",
        )],
    },
    Slide {
        title: "Voxelize, first bounce (1/2), first pass: lists",
        statements: &[
            S("the vertex shader fetches from the triangle buffer", "`glsl/ground/voxelise.vert`", &[]),
            S(
                "conservative rasterisation for any GPU by a geometry shader, or by the hardware; not perfect, so that more tests must follow",
                "`glsl/ground/voxelise.geom`: projected on its dominant axis and dilated by 0.51 pixels, or, for needles, the box about it; with \
                 `grid.conservative = hardware` by `VK_EXT_conservative_rasterization`, which has never been run: no device at hand has it",
                &[],
            ),
            S(
                "the pixel shader drops voxels that the dilated triangle does not meet",
                "`glsl/ground/voxelise.frag` goes through the voxels of its column and, in `printed`, tests what was dilated, by separating \
                 axes; elsewhere it tests the triangle itself, and the lists are exact (`tests/device/passes_voxelise.rs`: recall and precision are 1)",
                &["D30"],
            ),
            S(
                "and adds the triangle to the voxel's linked list",
                "`append` in `glsl/ground/list_append.glsl`; which triangle comes first is a race that no result depends on",
                &[],
            ),
        ],
        pictures: &[(
            "lists.png",
            "a slice of the lists from above, a little over the floor: blue voxels list one triangle, teal two, green up to four, yellow up to \
             eight, white more",
        )],
    },
    Slide {
        title: "Voxelize, first bounce (1/2), second pass: level 0",
        statements: &[
            S(
                "a vertex shader that chooses the layer, which often balances the load better than a compute shader",
                "`glsl/gi/cones/layered.vert`: one triangle over the screen per slice, `cones.passes = layered`. `cells` is this project's: \
                 threads for the occupied voxels alone, the same bits. [Layers against dispatches](layers.md) holds the claim against equal work",
                &[],
            ),
            S(
                "the pixel shader sums and averages the shaded colours of the listed triangles, without a bounce before",
                "`glsl/gi/cones/shade.frag` sums in fixed point, so that a list's order cannot matter (`glsl/ground/faces/fill.glsl`). How the \
                 average reaches the six directional targets is not said. Our reading is `cones.fill = uniform`: all seven get it. The \
                 author's later engine does as `cones.fill = front` does: a triangle goes to the three directions that see its front. \
                 [The ledger](ledger.md#two-fills-two-sets) measures both; the other fills are this project's",
                &["S6", "S7", "S8"],
            ),
        ],
        pictures: &[(
            "first-bounce.png",
            "level 0 of the first bounce, the slice of the lists, two stops brighter than the image; the faces that a traveller along \
             +x, +y, +z, −x and −y, −z meets, and the one for all. What is empty is grey. Printed, the first bounce has no shadows",
        )],
    },
    Slide {
        title: "Voxelize, first bounce (2/2), third pass: mips; isotropic vs anisotropic",
        statements: &[
            S(
                "layers again, by the vertex shader",
                "`glsl/gi/cones/layered.vert`, level by level (`src/gi/cones/mips.rs`)",
                &[],
            ),
            S(
                "each face is integrated along its direction, and the seventh is averaged: mipmapping by hand",
                "`glsl/gi/cones/mips.frag`, `glsl/ground/faces/mips.glsl`; the slides' two slips in `glsl/gi/cones/talk_mips.glsl`",
                &["D1", "D2"],
            ),
        ],
        pictures: &[(
            "mips.png",
            "levels 1 to 5 of +x, −x and the isotropic target: directional faces stay opaque, the average thins out. That −x shows +x's colours is D1",
        )],
    },
    Slide {
        title: "Reset some buffer counters",
        statements: &[S(
            "list items and voxel cells start anew; the triangles stay",
            "`lists` in `src/ground/reset.rs`",
            &["D29"],
        )],
        pictures: &[],
    },
    Slide {
        title: "Voxelize, second bounce (1/2 and 2/2)",
        statements: &[
            S(
                "the same passes into the second volume",
                "`relist` in `src/ground/mod.rs` makes identical lists; `cells` keeps the first ones",
                &["D29"],
            ),
            S(
                "and shading now gathers from the first bounce",
                "`glsl/gi/cones/shade.frag` with `LOOK_UP`: diffuse cones, and a specular one along the normal, as a voxel has no viewer; no refraction",
                &[],
            ),
        ],
        pictures: &[(
            "second-bounce.png",
            "level 0 of the second bounce, as above: what only bounced light reaches is no longer black, and with `printed` lights are shadowed",
        )],
    },
    Slide {
        title: "Render the recorded triangles",
        statements: &[
            S("a vertex shader that fetches from the triangle buffer", "`glsl/ground/image/image.vert`", &[]),
            S(
                "a pixel shader that shades with cones through the second bounce",
                "`glsl/ground/image/drawn.frag`, triangle by triangle, where a pass before found what each pixel sees; blended triangles follow \
                 back to front. Other presets shade packed fragments instead (`glsl/ground/image/image.frag`)",
                &[],
            ),
        ],
        pictures: &[
            (
                "one-bounce.png",
                "cones through the first bounce alone (`bounces=1`); the image with both stands at the top",
            ),
            (
                "corrected.png",
                "the preset `corrected`: the talk's set of five cones of 45°, errors of the listings corrected",
            ),
            ("corrected-16.png", "the preset `corrected-16`: the talk's set of sixteen cones of 17°"),
            ("path-traced.png", "two bounces path-traced, at the exposure of `printed`"),
        ],
    },
    Slide {
        title: "Diffuse cones; BRDF; specular cone",
        statements: &[
            S("several cones about the normal", "`gather_diffuse` in `glsl/gi/cones/look_up.glsl`", &["D21", "D22"]),
            S(
                "a picture of the BRDF",
                "glTF's metallic-roughness model: GGX, and what Fresnel leaves is diffuse (`glsl/ground/brdf.glsl`)",
                &[],
            ),
            S(
                "one cone for reflections, refraction and the like",
                "`gather_specular`, `gather_refraction` in `glsl/gi/cones/look_up.glsl`",
                &["D23", "D24", "S13"],
            ),
        ],
        pictures: &[(
            "indirect.png",
            "what cones gather: diffuse, reflected and refracted light, without direct light and without the lamps' own",
        )],
    },
    Slide {
        title: "Roughness to cone aperture",
        statements: &[S(
            "three maps; the intro used the polynomial",
            "`glsl/gi/cones/roughness.glsl`, `cones.roughness_fit`: polynomial, power, linear; ggx is this project's",
            &["D25"],
        )],
        pictures: &[],
    },
    Slide {
        title: "Soft shadows",
        statements: &[S(
            "a picture of shadows by cones",
            "`lights.shadows = method`, as `printed` has it; rays are this project's",
            &["D12", "D13", "D15", "D16", "S3"],
        )],
        pictures: &[("direct.png", "what lights send directly, shadowed by cones, and what lamps show of themselves")],
    },
    Slide {
        title: "Code: small functions, direction weights, cone",
        statements: &[
            S(
                "the listings are CC0, with a wish for credit",
                "named where they are used: `src/gi/cones/mod.rs`, `glsl/gi/cones/cone_set.glsl`, the README",
                &[],
            ),
            S("`safeNormalize`", "lengths are guarded where they can be 0, as in `glsl/gi/cones/look_up.glsl`", &[]),
            S(
                "`voxelJitterNoise`",
                "`jitter_hash` in `glsl/common/jitter.glsl`: integers, the same on every device",
                &["D9"],
            ),
            S("`vctRotationMatrix`", "`jitter_rotation` in `glsl/gi/cones/cone_set.glsl`", &["D7", "D8"]),
            S(
                "`getDirectionWeights`: three forms, of which d² is on",
                "`direction_weights` in `glsl/gi/cones/cone.glsl`; `cones.weights`: d2, norm1, abs; extinction is this project's",
                &[],
            ),
            S(
                "`traceVoxelCone`",
                "`trace_cone` in `glsl/gi/cones/cone.glsl`",
                &["D4", "D10", "D11", "D17", "D18", "S1"],
            ),
        ],
        pictures: &[],
    },
    Slide {
        title: "Code: shadow cone",
        statements: &[S(
            "`traceShadowCone`: 5° of half angle, steps of a third, the isotropic target's alpha",
            "`trace_shadow_cone` in `glsl/gi/cones/cone.glsl`, begun by `method_shadow` in `glsl/gi/cones/look_up.glsl`; \
             `cones.shadow_half_angle`, `cones.shadow_step`, `cones.shadow_jitter`, `cones.start.shadow_along`",
            &["D9", "D12", "D13", "D14", "D15", "D16", "S4"],
        )],
        pictures: &[],
    },
    Slide {
        title: "Code: diffuse, specular and refracted light",
        statements: &[
            S(
                "`indirectDiffuseLight`: five cones of 45°, started 3.8 voxels along the normal and 4 along the cone less a hundredth of the volume",
                "`gather_diffuse` in `glsl/gi/cones/look_up.glsl`; the hundredth is `cones.start.diffuse_offset`; the jitter under `#ifdef` is `cones.jitter`",
                &["D7", "D8", "D9", "D19", "D20", "D21", "D22", "S5"],
            ),
            S(
                "`indirectSpecularLight`: 2 voxels along the normal, 2 along the reflected view",
                "`gather_specular`; `cones.start.specular_normal`, `cones.start.specular_along`",
                &["D21"],
            ),
            S(
                "`indirectRefractiveLight`: 1 voxel along the normal, 1 along the refracted view",
                "`gather_refraction`; the direction in `glsl/common/refraction.glsl`",
                &["D21", "D23", "D24"],
            ),
        ],
        pictures: &[],
    },
    Slide {
        title: "Code: mips (two slides)",
        statements: &[
            S("`voxelIndex`, `fetchVoxels`", "indices are written out in `glsl/ground/faces/mips.glsl`", &["D3"]),
            S("six blocks, one per direction of travel", "`mip_directional`, one function for all six", &["D1", "D2"]),
            S("`mipMapVoxelColor`", "`mip_average`", &[]),
        ],
        pictures: &[],
    },
    Slide {
        title: "Code: more sets of diffuse cones (four slides)",
        statements: &[
            S("one cone of 63.4°", "`cones.set=1`", &[]),
            S("six, weights 1 and 0.607", "`cones.set=6a`", &["D6"]),
            S("six of 30°, weights ¼ and 3⁄20", "`cones.set=6b`", &["D5"]),
            S("sixteen over the sphere, equal weights", "`cones.set=16`", &["D26"]),
        ],
        pictures: &[],
    },
];

const OPENING: &str = "# The talk, slide by slide

Written by `cargo run --release --example talk`, pictures too; `tests/values/talk.rs` holds it against what is there.

The talk is BeRo and urs, \"How to use Voxel Cone Tracing with two bounces for everything instead of just Global Illumination\"; its
listings are CC0. Left: the slide, in other words. Middle: the code and what differs. Right: rows of [the ledger](ledger.md), which
measures printed and right forms. This project adds ambient occlusion, the sky, rays, lists of cells, further fills and the study.

All pictures are of `assets/gallery.glb` at 512×512 pixels and 128³ voxels.
";

const TIMES: &str = "\n## Times of the stages\n";

/// The part of a page that [`times`] wrote; `None` for a page without it.
pub fn times_of(page: &str) -> Option<&str> {
    page.find(TIMES).map(|at| &page[at..])
}

/// A table of milliseconds: a column for each preset, a row for each pass with its cells by column.
pub fn times(device: &str, presets: &[&str], rows: &[(&str, Vec<(usize, f64)>)]) -> String {
    let mut text = format!(
        "{TIMES}\nMilliseconds of device time on {device}: the gallery at 512×512 pixels and 128³ voxels, every frame from scratch, \
         median of three.\n\n| pass | {} |\n|---|{}\n",
        presets.join(" | "),
        "---:|".repeat(presets.len())
    );
    for (pass, cells) in rows {
        let cell = |column: usize| {
            cells.iter().find(|cell| cell.0 == column).map_or("–".into(), |cell| format!("{:.1}", cell.1))
        };
        let cells: Vec<String> = (0..presets.len()).map(cell).collect();
        writeln!(text, "| {pass} | {} |", cells.join(" | ")).expect("text takes text");
    }
    let sum = |column: usize| {
        rows.iter().flat_map(|row| &row.1).filter(|cell| cell.0 == column).map(|cell| cell.1).sum::<f64>()
    };
    let sums: Vec<String> = (0..presets.len()).map(|column| format!("{:.0}", sum(column))).collect();
    writeln!(text, "| all | {} |", sums.join(" | ")).expect("text takes text");
    text
}

/// The page. `times`: of [`times`].
pub fn document(times: &str) -> String {
    let mut page = OPENING.to_owned();
    for slide in SLIDES {
        write!(page, "\n## {}\n| the slides | here | ledger |\n|---|---|---|\n", slide.title).expect("text takes text");
        for S(says, here, rows) in slide.statements {
            writeln!(page, "| {says} | {here} | {} |", rows.join(" ")).expect("text takes text");
        }
        for (file, shows) in slide.pictures {
            write!(page, "\n![{file}](talk/{file})\n\n*{}{}.*\n", shows[..1].to_uppercase(), &shows[1..])
                .expect("text");
        }
    }
    page + times
}
