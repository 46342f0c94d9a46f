//! The frame against the talk's tables: passes, stages, resources, formats, order. The frame's side is its recorded
//! commands and the pipelines' SPIR-V; the passes themselves declare nothing here.

use crate::gpu;
use crate::studio::asset;

use std::path::Path;

use twobounce::settings::{Bounces, Settings};
use twobounce::vk::{CallLog, DrawLog, FrameLog, ShaderStage, ZoneLog};

const EDGE: u32 = 16;

/// One pass of the talk ("Algorithm, how it's implemented in the 64k intro").
struct TalkPass {
    zone: &'static str,
    /// The talk's own words, shortened.
    does: &'static str,
    /// Shader stages of every draw of the pass; none for a fill.
    stages: &'static [ShaderStage],
    writes: Writes,
}

enum Writes {
    /// Fills of these buffers.
    Fills(&'static [&'static str]),
    /// Only buffers, over a square screen of this many pixels.
    Buffers { screen: u32 },
    /// Seven RGBA16F targets of these levels of the volume, a layer per slice.
    Volume { name: &'static str, levels: std::ops::Range<u32> },
    /// The image.
    Image,
    /// The visible triangle and its depth.
    Visibility,
    /// The image, from the drawn surfaces, in a compute pass.
    Resolved,
}

const VF: &[ShaderStage] = &[ShaderStage::Vertex, ShaderStage::Fragment];
const VGF: &[ShaderStage] = &[ShaderStage::Vertex, ShaderStage::Geometry, ShaderStage::Fragment];

const fn volume(name: &'static str, first: u32, end: u32) -> Writes {
    Writes::Volume { name, levels: first..end }
}

#[rustfmt::skip]
const TALK: [TalkPass; 12] = [
    TalkPass { zone: "reset", does: "reset buffer counters", stages: &[], writes: Writes::Fills(&["globals", "voxels"]) },
    TalkPass { zone: "record", does: "record geometry triangles into a buffer", stages: VGF, writes: Writes::Buffers { screen: 128 } },
    TalkPass { zone: "voxelise", does: "voxelise the recorded triangles", stages: VGF, writes: Writes::Buffers { screen: EDGE } },
    TalkPass { zone: "shade 1", does: "sum and average, without a previous bounce", stages: VF, writes: volume("first bounce", 0, 1) },
    TalkPass { zone: "mips 1", does: "multi-directional anisotropic preintegration", stages: VF, writes: volume("first bounce", 1, 5) },
    TalkPass { zone: "reset lists", does: "reset some buffer counters", stages: &[], writes: Writes::Fills(&["globals", "voxels"]) },
    TalkPass { zone: "voxelise 2", does: "voxelise the recorded triangles again", stages: VGF, writes: Writes::Buffers { screen: EDGE } },
    TalkPass { zone: "shade 2", does: "now with the previous first bounce", stages: VF, writes: volume("second bounce", 0, 1) },
    TalkPass { zone: "mips 2", does: "multi-directional anisotropic preintegration", stages: VF, writes: volume("second bounce", 1, 5) },
    TalkPass { zone: "visibility", does: "ours: which triangle every sample sees", stages: VF, writes: Writes::Visibility },
    TalkPass { zone: "image", does: "render the recorded triangles", stages: VF, writes: Writes::Image },
    TalkPass { zone: "resolve", does: "ours: sky, blended surfaces, the mean of a pixel's samples", stages: &[], writes: Writes::Resolved },
];

fn frame(settings: &Settings) -> FrameLog {
    let scene = asset("cornell-point.glb");
    gpu::render(&gpu::context(), &scene, settings, 32).log().expect("the log is kept").clone()
}

fn printed() -> Settings {
    Settings { voxels: EDGE, ..Settings::printed() }
}

fn bound<'a>(draw: &'a DrawLog, name: &str) -> Option<&'a [String]> {
    draw.resources.iter().find(|(binding, _)| binding == name).map(|(_, labels)| labels.as_slice())
}

/// Differences between a log and the talk's table, pass by pass.
fn differences(log: &FrameLog) -> Vec<String> {
    let zones: Vec<&str> = log.zones.iter().map(|z| z.name).filter(|n| !n.is_empty()).collect();
    let wanted: Vec<&str> = TALK.iter().map(|p| p.zone).collect();
    if zones != wanted {
        return vec![format!("the passes are {zones:?}, not {wanted:?}")];
    }
    TALK.iter().flat_map(|pass| log.zones_named(pass.zone).flat_map(|zone| pass_differences(pass, zone))).collect()
}

fn pass_differences(pass: &TalkPass, zone: &ZoneLog) -> Vec<String> {
    let draws: Vec<&DrawLog> = zone.draws().collect();
    let mut wrong = Vec::new();
    let mut check = |holds: bool, what: &str| {
        if !holds {
            wrong.push(format!("{} ({}): {what}", pass.zone, pass.does));
        }
    };
    let dispatches = usize::from(matches!(pass.writes, Writes::Resolved));
    check(zone.dispatches().count() == dispatches, "is raster work, not compute");
    for draw in &draws {
        let stages: Vec<ShaderStage> = draw.stages.iter().map(|s| s.stage).collect();
        check(stages == pass.stages, &format!("has stages {stages:?}"));
    }
    match &pass.writes {
        Writes::Fills(buffers) => {
            let filled: Vec<&str> = zone.fills().collect();
            check(draws.is_empty(), "draws nothing");
            check(buffers.iter().all(|b| filled.contains(b)), &format!("fills {filled:?}"));
            check(!filled.contains(&"triangles"), "leaves the triangles alone");
        }
        Writes::Buffers { screen } => {
            check(!draws.is_empty(), "draws");
            for draw in &draws {
                check((draw.target.width, draw.target.height) == (*screen, *screen), "has a screen of its size");
                check(draw.target.colors.is_empty() || !draw.color_write, "masks all colour writes");
                check(draw.target.depth.is_none(), "has no depth");
                check(bound(draw, "triangles").is_some() && bound(draw, "globals").is_some(), "uses the triangles");
            }
        }
        Writes::Volume { name, levels } => {
            check(draws.len() == levels.len(), "draws once per level");
            for (draw, level) in draws.iter().zip(levels.clone()) {
                volume_differences(draw, name, level, &mut check);
            }
        }
        Writes::Visibility | Writes::Resolved => {}
        Writes::Image => {
            for draw in &draws {
                check(
                    matches!(&draw.call, CallLog::Indirect { buffer, .. } if buffer == "globals"),
                    "draws what was recorded",
                );
                check(bound(draw, "triangles").is_some(), "fetches from the triangle buffer");
            }
            let gathers = draws.iter().filter_map(|d| bound(d, "volume_0"));
            check(gathers.clone().all(|v| v[0].starts_with("second bounce")), "gathers from the second bounce");
            check(gathers.count() > 0, "gathers");
        }
    }
    let previous = draws.first().and_then(|d| bound(d, "volume_0"));
    match pass.zone {
        "shade 1" => check(previous.is_none(), "has no previous bounce bound"),
        "shade 2" => check(previous.is_some_and(|v| v[0].starts_with("first bounce")), "gathers from the first bounce"),
        _ => {}
    }
    wrong
}

fn volume_differences(draw: &DrawLog, name: &str, level: u32, check: &mut impl FnMut(bool, &str)) {
    let edge = EDGE >> level;
    let faces: Vec<&str> = draw.target.colors.iter().map(|c| c.image.as_str()).collect();
    let wanted = ["+x", "+y", "+z", "-x", "-y", "-z", "isotropic"].map(|face| format!("{name} {face}"));
    check(faces == wanted, &format!("writes {faces:?}"));
    check(
        draw.target.colors.iter().all(|c| c.format == "R16G16B16A16_SFLOAT" && c.level == level),
        "has its formats and level",
    );
    check(draw.color_write, "writes colour");
    check((draw.target.width, draw.target.height, draw.target.layers) == (edge, edge, edge), "has a layer per slice");
    check(draw.call == CallLog::Direct { vertices: 3, instances: edge }, "draws one full-screen triangle per slice");
}

#[test]
fn the_frame_is_the_talks() {
    assert_eq!(differences(&frame(&printed())), Vec::<String>::new());
}

#[test]
fn the_corrected_frame_has_the_same_passes_and_with_rays_what_they_need() {
    let corrected = Settings { voxels: EDGE, ..Settings::corrected() };
    assert_eq!(differences(&frame(&corrected)), Vec::<String>::new());
    let mut log = frame(&gpu::with(corrected, &["lights.shadows=rays"]));
    let tree = log.zones.iter().position(|zone| zone.name == "tree").expect("shadows are rays");
    let before = log.zones[..tree].iter().rfind(|zone| !zone.name.is_empty()).map(|zone| zone.name);
    assert_eq!(before, Some("record"));
    log.zones.remove(tree);
    assert_eq!(differences(&log), Vec::<String>::new());
}

#[test]
fn a_frame_without_one_of_the_passes_is_another() {
    let log = frame(&printed());
    for i in 0..log.zones.len() {
        let mut less = log.clone();
        if less.zones.remove(i).name.is_empty() {
            continue;
        }
        assert!(!differences(&less).is_empty(), "zone {i} is not missed");
    }
    for changed in [gpu::with(printed(), &["cones.passes=cells"]), Settings { bounces: Bounces::One, ..printed() }] {
        assert!(!differences(&frame(&changed)).is_empty());
    }
}

#[test]
fn a_pass_goes_by_one_name_everywhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let exists = |path: String| assert!(root.join(&path).exists(), "{path} is missing");
    let stem = |zone: &str| zone.split(' ').next().unwrap_or_default().to_owned();
    for pass in TALK {
        let name = stem(pass.zone);
        let folders = ["ground", "ground/image", "gi/cones"];
        let beside = |folder: &str, ending: &str| {
            root.join(format!("{folder}/{name}{ending}")).exists()
                || root.join(format!("{folder}/{name}/mod.rs")).exists()
        };
        assert!(folders.iter().any(|f| beside(&format!("src/{f}"), ".rs")), "no file of src is called {name}");
        for stage in pass.stages.iter().filter(|s| **s == ShaderStage::Fragment) {
            let found = folders.iter().any(|f| {
                beside(&format!("glsl/{f}"), ".frag") || root.join(format!("glsl/{f}/{name}/{name}.frag")).exists()
            });
            assert!(found, "there is no {stage:?} shader of {name}");
        }
    }
    for twin in ["record", "voxelise", "shade", "mips", "cone"] {
        exists(format!("tests/twins/{twin}.rs"));
    }
}
