//! The table of `docs/plan.md`: on scenes of different kinds, what `twobounce plan` answers against the best of a full sweep of the
//! same settings, and what both cost.
//!
//! `cargo run --release --example plan_table -- target/release/twobounce [--sweeps tests/plan] [box|exterior|lamps|gallery|SCENE.glb…]`;
//! a scene takes five to forty minutes on two slow cores. `--sweeps`: sweeps are kept there, and taken from there where they are; a test
//! of `src/plan/search.rs` lets the search find its way through them.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use glam::Vec3;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use twobounce::lab::store::Results;
use twobounce::layers::Layers;
use twobounce::measure::metrics::Part;
use twobounce::plan::answer::Answer;
use twobounce::plan::bench::{Bench, OF_PIXELS, Seen, Setup};
use twobounce::plan::needs::Needs;
use twobounce::plan::space::{Place, Space, spaces};
use twobounce::reference::Options;
use twobounce::reference::cache::Cache;
use twobounce::renderer::{Context, ContextOptions, RenderOptions};
use twobounce::scene::{LoadOptions, Scene};
use twobounce::settings::Settings;

/// Pixels of all images.
const SIZE: (u32, u32) = (64, 64);

/// What all settings have, so that every combination of the rest can be measured: 288 of rays, 72 of lpv, 4 of none.
const FIXED: [&str; 7] = [
    "voxels=32",
    "bounces=2",
    "rays.bounce=1",
    "rays.glossy=8",
    "lights.lamp_points=4",
    "lights.voxel_lamp_points=4",
    "lights.shadow_rays=1",
];
const METHODS: [&str; 3] = ["none", "rays", "lpv"];

/// Samples per pixel of the sweep's reference: 16 · 4ⁿ.
const LEVEL: u32 = 2;

/// Rounds of the final times.
const ROUNDS: usize = 7;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1).map(PathBuf::from);
    let program = args.next().ok_or("name the program: target/release/twobounce")?;
    let folder = tempfile::tempdir()?;
    let (exterior, lamps) = (folder.path().join("exterior.gltf"), folder.path().join("lamps.gltf"));
    std::fs::write(&exterior, serde_json::to_vec(&exterior_scene())?)?;
    std::fs::write(&lamps, serde_json::to_vec(&lamps_scene())?)?;
    let mut named: Vec<PathBuf> = args.collect();
    let keeps = named.len() > 1 && named[0].as_os_str() == "--sweeps";
    let sweeps = if keeps { named.drain(..2).nth(1) } else { None };
    let all = ["box", "exterior", "lamps", "gallery"].map(PathBuf::from);
    let scenes = if named.is_empty() { all.to_vec() } else { named };
    let scenes = scenes.into_iter().map(|name| match name.to_str() {
        Some("box") => ("assets/cornell-point.glb".into(), None),
        Some("gallery") => ("assets/gallery.glb".into(), None),
        Some("exterior") => (exterior.clone(), Some(0.5)),
        Some("lamps") => (lamps.clone(), None),
        _ => (name, None),
    });
    println!(
        "| scene | limit | plan | its ms | its error | best of the sweep | its ms | its error | ratio | settings measured | CPU s |"
    );
    println!("|---|---:|---|---:|---:|---|---:|---:|---:|---:|---:|");
    for (path, sky) in scenes {
        println!("{}", row(&program, &path, sky, (folder.path(), sweeps.as_deref()))?);
    }
    Ok(())
}

/// Settings, milliseconds and error.
type Row = (Settings, f64, f64);

/// A full sweep, as it is kept: bits of times are of no use, so that they are rounded.
#[derive(Serialize, Deserialize)]
struct Swept {
    /// Seconds of processor time that it took.
    cpu_s: f64,
    /// Method, rung of each ladder, milliseconds of the passes over voxels and pixels, error.
    rows: Vec<(String, Place, [f64; 2], f64)>,
}

impl Swept {
    fn measure(
        bench: &mut Bench,
        spaces: &[Space],
        (seen, reference): (&Seen, &Layers),
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let mut rows = Vec::new();
        for space in spaces.iter().filter(|space| METHODS.contains(&space.method.name())) {
            for place in space.places() {
                let settings = space.settings(&place);
                let row = bench.row(&settings, seen)?;
                let reading = bench.judge(&row, reference)?;
                let of_pixels = reading.passes.iter().filter(|pass| OF_PIXELS.iter().any(|of| pass.0.starts_with(of)));
                let of_pixels: f64 = of_pixels.map(|pass| pass.1).sum();
                let ms = [reading.ms - of_pixels, of_pixels].map(|ms| rounded(ms, 1e3));
                rows.push((space.method.name().to_owned(), place, ms, rounded(reading.error, 1e5)));
            }
        }
        Ok(Self { cpu_s: bench.spent_cpu_s().unwrap_or(f64::NAN).round(), rows })
    }

    /// A row a line.
    fn json(&self) -> String {
        let rows: Vec<String> = self.rows.iter().map(|row| json!(row).to_string()).collect();
        format!("{{\"cpu_s\": {}, \"rows\": [\n{}\n]}}\n", self.cpu_s, rows.join(",\n"))
    }

    /// Settings, milliseconds and error of each row.
    fn settings(&self, spaces: &[Space]) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
        let of = |(method, place, ms, error): &(String, Place, [f64; 2], f64)| {
            let space =
                spaces.iter().find(|space| space.method.name() == method).ok_or("a kept sweep is of other methods")?;
            Ok((space.settings(place), ms.iter().sum(), *error))
        };
        self.rows.iter().map(of).collect()
    }
}

fn rounded(value: f64, per_one: f64) -> f64 {
    (value * per_one).round() / per_one
}

/// A line of the table.
fn row(
    program: &Path,
    path: &Path,
    sky: Option<f32>,
    (folder, sweeps): (&Path, Option<&Path>),
) -> Result<String, Box<dyn std::error::Error>> {
    let mut scene = Scene::load(path, &LoadOptions::default())?;
    scene.sky += Vec3::splat(sky.unwrap_or(0.0));
    let pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    let bounds = scene.bounds(None);
    let seen = Seen { words: "the view".into(), pose, view };
    let context = Context::new(&ContextOptions::default())?;
    let cache = Cache::at(folder.join("films"));
    let store = Results::new(None, "", true)?;
    let trace =
        |seen: &Seen, options: &Options| cache.render(seen.still(&scene), options, &|_| (), &AtomicBool::new(false));
    let mut bench = Bench::new(Setup {
        context: &context,
        scene: &scene,
        options: RenderOptions::new(SIZE, bounds),
        size: SIZE,
        part: Part::Total,
        store: &store,
        trace: &trace,
        is_at: &|_| (),
    });
    bench.level = LEVEL;
    let reference = bench.reference(&seen, 0)?;
    let fixed = FIXED.map(str::to_owned);
    let spaces = spaces(&Needs::of(&scene), &fixed)?;
    let kept = sweeps.map(|folder| folder.join(format!("{}.json", scene.name)));
    let swept = match kept.as_ref().filter(|kept| kept.exists()) {
        Some(kept) => serde_json::from_slice(&std::fs::read(kept)?)?,
        None => {
            let swept = Swept::measure(&mut bench, &spaces, (&seen, &reference))?;
            if let Some(kept) = kept {
                std::fs::write(kept, swept.json())?;
            }
            swept
        }
    };
    let mut sweep = swept.settings(&spaces)?;
    // As right as a fifth of all settings are: neither trivial nor out of reach.
    let mut errors: Vec<f64> = sweep.iter().map(|(.., error)| *error).collect();
    errors.sort_by(f64::total_cmp);
    let limit = (errors[errors.len() / 5] * 1e3).ceil() / 1e3;
    let answer = plan(program, path, (sky, limit, &fixed), &folder.join(&scene.name))?;
    sweep.retain(|(.., error)| *error <= limit);
    sweep.sort_by(|a, b| a.1.total_cmp(&b.1));
    // The sweep's times are of one frame or a few: its fastest are timed again, in turns with the answer.
    let fastest: Vec<&Settings> = sweep.iter().take(4).map(|(settings, ..)| settings).collect();
    let all: Vec<Settings> = std::iter::once(&answer.choice.settings).chain(fastest).cloned().collect();
    let timed = bench.times(&all, std::slice::from_ref(&seen), ROUNDS, Instant::now() + Duration::from_secs(600))?;
    let ms: Vec<f64> = timed.iter().map(|(timings, _)| timings.frame_gpu_ms().median).collect();
    let best = (1..all.len()).min_by(|a, b| ms[*a].total_cmp(&ms[*b])).ok_or("nothing holds")?;
    let error = sweep[best - 1].2;
    let row = bench.row(&answer.choice.settings, &seen)?;
    let own_error = bench.judge(&row, &reference)?.error;
    let words = |settings: &Settings| {
        let of = |key: &str| {
            settings.entries().into_iter().find(|entry| entry.0.name == key).map(|entry| entry.1).unwrap_or_default()
        };
        let own = match settings.method.name() {
            "rays" => format!(", {} rays", of("rays.diffuse")),
            "lpv" => format!(", {} cells", of("lpv.edge")),
            _ => String::new(),
        };
        let (gather, interleave, samples) =
            (of("image.gather_resolution"), of("image.interleave"), of("image.samples"));
        format!("{}{own}, {gather}, interleave {interleave}, {samples} samples", settings.method)
    };
    Ok(format!(
        "| {} | {limit} | {} | {:.1} | {own_error:.4} | {} | {:.1} | {error:.4} | {:.2} | {} of {} | {:.0} of {:.0} |",
        scene.name,
        words(&all[0]),
        ms[0],
        words(&all[best]),
        ms[best],
        ms[0] / ms[best],
        answer.measured,
        errors.len(),
        answer.measuring_cpu_s.unwrap_or(f64::NAN),
        swept.cpu_s,
    ))
}

/// The answer of the program, with nothing kept from before: neither rows nor pipelines.
fn plan(
    program: &Path,
    path: &Path,
    (sky, limit, fixed): (Option<f32>, f64, &[String]),
    caches: &Path,
) -> Result<Answer, Box<dyn std::error::Error>> {
    let json = caches.with_extension("json");
    let mut command = Command::new(program);
    command.env("XDG_CACHE_HOME", caches).env("TWOBOUNCE_CACHE", caches).arg("plan").arg(path);
    command.args([
        "--size",
        &format!("{}x{}", SIZE.0, SIZE.1),
        "--max-error",
        &limit.to_string(),
        "--budget",
        "1h",
        "-q",
    ]);
    command.args(["--default-light", "off", "--methods", &METHODS.join(","), "--json"]).arg(&json);
    command.args(sky.map(|sky| format!("--sky={sky},{sky},{sky}")));
    command.args(fixed.iter().flat_map(|set| ["--set", set]));
    let status = command.status()?;
    if status.code() != Some(0) {
        eprintln!("{}: {status}", path.display());
    }
    Ok(serde_json::from_slice(&std::fs::read(json)?)?)
}

/// A box of a scene: centre and size in metres, colour, and what it emits.
type Block = ([f32; 3], [f32; 3], [f32; 3], f32);

/// Houses on a plain, lit by a sun and a sky.
fn exterior_scene() -> Value {
    let mut blocks: Vec<Block> = vec![([0.0, -0.25, 0.0], [24.0, 0.5, 24.0], [0.5, 0.5, 0.45], 0.0)];
    for i in 0..9u8 {
        let (x, z, h) = (f32::from(i % 3) * 5.0 - 5.0, f32::from(i / 3) * 5.0 - 5.0, 1.5 + f32::from(i * 7 % 5));
        blocks.push(([x, 0.5 * h, z], [2.5, h, 2.5], [0.8 - 0.06 * f32::from(i), 0.6, 0.3 + 0.05 * f32::from(i)], 0.0));
    }
    let sun = json!({ "type": "directional", "intensity": 3.0 });
    gltf(&blocks, &sun, [-0.35, 0.25, 0.1, 0.9], [0.0, 6.0, 17.0])
}

/// A hall with 64 lamps below its ceiling.
fn lamps_scene() -> Value {
    let mut blocks: Vec<Block> = vec![
        ([0.0, -0.25, 0.0], [12.0, 0.5, 12.0], [0.6, 0.6, 0.6], 0.0),
        ([0.0, 4.25, 0.0], [12.0, 0.5, 12.0], [0.7, 0.7, 0.7], 0.0),
        ([-6.25, 2.0, 0.0], [0.5, 4.0, 12.0], [0.7, 0.3, 0.2], 0.0),
        ([6.25, 2.0, 0.0], [0.5, 4.0, 12.0], [0.2, 0.4, 0.7], 0.0),
        ([0.0, 2.0, -6.25], [12.0, 4.0, 0.5], [0.7, 0.7, 0.6], 0.0),
        ([-2.0, 0.75, -1.0], [1.5, 1.5, 1.5], [0.7, 0.7, 0.3], 0.0),
        ([2.0, 1.25, -2.0], [1.0, 2.5, 1.0], [0.5, 0.7, 0.5], 0.0),
    ];
    for i in 0..64u8 {
        let (x, z) = (f32::from(i % 8) * 1.4 - 4.9, f32::from(i / 8) * 1.4 - 4.9);
        blocks.push(([x, 3.6, z], [0.2, 0.1, 0.2], [0.8, 0.8, 0.8], 12.0));
    }
    gltf(&blocks, &json!({ "type": "point", "intensity": 1.0 }), [0.0, 0.0, 0.0, 1.0], [0.0, 2.0, 9.0])
}

/// A file with its buffer inside: a mesh per block, a light, a camera that looks along −Z.
fn gltf(blocks: &[Block], light: &Value, turned: [f32; 4], eye: [f32; 3]) -> Value {
    let (mut positions, mut indices): (Vec<f32>, Vec<u32>) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-0.5f32, 0.5] {
            let first = positions.len() as u32 / 3;
            for (u, v) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
                let mut corner = [0.0; 3];
                (corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (side, u, v);
                positions.extend(corner);
            }
            let face = if side > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            indices.extend(face.map(|corner| first + corner));
        }
    }
    use base64::prelude::{BASE64_STANDARD, Engine};
    let bytes = [bytemuck::cast_slice::<f32, u8>(&positions), bytemuck::cast_slice(&indices)].concat();
    let primitive = |material: usize| json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": material });
    let nodes =
        blocks.iter().enumerate().map(|(i, block)| json!({ "mesh": i, "translation": block.0, "scale": block.1 }));
    let count = blocks.len();
    let mut nodes: Vec<Value> = nodes.collect();
    nodes.push(json!({ "rotation": turned, "translation": [0.0, 3.2, 3.0], "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    nodes.push(json!({ "camera": 0, "translation": eye, "rotation": [-0.1, 0.0, 0.0, 0.995] }));
    let materials = blocks.iter().map(|(_, _, [r, g, b], emits)| {
        json!({
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "emissiveFactor": [if *emits > 0.0 { 1.0 } else { 0.0 }, if *emits > 0.0 { 0.9 } else { 0.0 }, if *emits > 0.0 { 0.7 } else { 0.0 }],
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": emits.max(1.0) } }
        })
    });
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
        "extensions": { "KHR_lights_punctual": { "lights": [light] } },
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.05 } }],
        "scenes": [{ "nodes": (0..count + 2).collect::<Vec<_>>() }],
        "scene": 0,
        "nodes": nodes,
        "materials": materials.collect::<Vec<_>>(),
        "meshes": (0..count).map(|i| json!({ "primitives": [primitive(i)] })).collect::<Vec<_>>(),
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 24, "type": "VEC3", "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5] },
            { "bufferView": 1, "componentType": 5125, "count": 36, "type": "SCALAR" }
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 288 }, { "buffer": 0, "byteOffset": 288, "byteLength": 144 }],
        "buffers": [{ "byteLength": 432, "uri": format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(&bytes)) }]
    })
}
