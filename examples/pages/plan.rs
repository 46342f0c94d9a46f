//! The table of `docs/notes/plan.md`: on scenes of different kinds, the answer of `twobounce plan` against the best of
//! a full sweep of its settings, and the cost of both. A scene takes five to forty minutes on two slow cores.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use serde_json::json;
use twobounce::assets::make;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::store::Results;
use twobounce::lab::table::markdown;
use twobounce::layers::Layers;
use twobounce::measure::metrics::Part;
use twobounce::plan::answer::Answer;
use twobounce::plan::bench::{Bench, OF_PIXELS, PlanView, Setup};
use twobounce::plan::needs::Needs;
use twobounce::plan::space::{Rungs, Space, spaces};
use twobounce::reference::Options;
use twobounce::reference::cache::Cache;
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

#[derive(Args)]
pub struct Plan {
    /// The program: target/release/twobounce
    program: PathBuf,
    /// A folder that stores sweeps, and from which they are read; a test of src/plan/search.rs runs the search on those
    /// of tests/plan
    #[arg(long)]
    sweeps: Option<PathBuf>,
    /// box, exterior, lamps, gallery, or files
    #[arg(default_values = ["box", "exterior", "lamps", "gallery"])]
    scenes: Vec<PathBuf>,
}

/// Pixels of all images.
const SIZE: (u32, u32) = (64, 64);

/// Settings of every combination, so that every combination of the rest can be measured: 288 of rays, 72 of lpv, 4 of
/// none.
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

impl Plan {
    pub fn run(&self) -> Result<()> {
        let folder = tempfile::tempdir()?;
        let folder = folder.path();
        let write = |name: &str, scene: twobounce::Result<Vec<u8>>| -> Result<PathBuf> {
            let path = folder.join(name);
            std::fs::write(&path, scene?)?;
            Ok(path)
        };
        let mut rows = Vec::new();
        for name in &self.scenes {
            let (path, sky) = match name.to_str() {
                Some("box") => ("assets/cornell-point.glb".into(), 0.0),
                Some("gallery") => ("assets/gallery.glb".into(), 0.0),
                Some("exterior") => (write("exterior.glb", exterior_scene())?, 0.5),
                Some("lamps") => (write("lamps.glb", lamps_scene())?, 0.0),
                _ => (name.clone(), 0.0),
            };
            rows.push(self.row(&Subject { path: &path, sky, folder })?);
            eprintln!("{}", rows[rows.len() - 1].join(" | "));
        }
        let head = "scene|limit|plan|its ms|its error|best of the sweep|its ms|its error|ratio|settings measured|CPU s";
        print!("{}", markdown(head.split('|'), "-:-::-:::::", rows));
        Ok(())
    }
}

/// A scene to plan for.
struct Subject<'a> {
    path: &'a Path,
    /// Radiance of the sky that is added to the file's.
    sky: f32,
    /// The folder for caches of the planning program.
    folder: &'a Path,
}

/// Settings, milliseconds and error.
type ScoredSettings = (Settings, f64, f64);

/// A full sweep in its stored form: times are rounded, because their last bits mean nothing.
#[derive(Serialize, Deserialize)]
struct Swept {
    /// Processor time of the sweep in seconds.
    cpu_s: f64,
    /// Method, rung of each ladder, milliseconds of the passes over voxels and pixels, error.
    rows: Vec<(String, Rungs, [f64; 2], f64)>,
}

impl Swept {
    fn measure(bench: &mut Bench, spaces: &[Space], seen: &PlanView, reference: &Layers) -> Result<Self> {
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
    fn settings(&self, spaces: &[Space]) -> Result<Vec<ScoredSettings>> {
        let of = |(method, place, ms, error): &(String, Rungs, [f64; 2], f64)| {
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

impl Plan {
    /// A line of the table.
    fn row(&self, subject: &Subject) -> Result<Vec<String>> {
        let mut specimen = Specimen::load(subject.path)?;
        specimen.scene.sky += Vec3::splat(subject.sky);
        let Specimen { scene, pose, view } = &specimen;
        let seen = PlanView { words: "the view".into(), flags: vec![], pose: pose.clone(), view: *view };
        let context = Context::new(&ContextOptions::default())?;
        let cache = Cache::at(subject.folder.join("films"));
        let store = Results::new(None, "", true)?;
        let trace = |seen: &PlanView, options: &Options| {
            cache.render(seen.still(scene), options, &|_| (), &AtomicBool::new(false))
        };
        let mut bench = Bench::new(Setup {
            context: &context,
            scene,
            options: specimen.options(SIZE),
            size: SIZE,
            part: Part::Total,
            store: &store,
            trace: &trace,
            is_at: &|_| (),
        });
        bench.level = LEVEL;
        let reference = bench.reference(&seen, 0)?;
        let fixed = FIXED.map(str::to_owned);
        let spaces = spaces(&Needs::of_scene(scene), &fixed)?;
        let kept = self.sweeps.as_ref().map(|folder| folder.join(format!("{}.json", scene.name)));
        let swept = match kept.as_ref().filter(|kept| kept.exists()) {
            Some(kept) => serde_json::from_slice(&std::fs::read(kept)?)?,
            None => {
                let swept = Swept::measure(&mut bench, &spaces, &seen, &reference)?;
                if let Some(kept) = kept {
                    std::fs::write(kept, swept.json())?;
                }
                swept
            }
        };
        let mut sweep = swept.settings(&spaces)?;
        // An error as small as the best fifth of all settings reaches: neither trivial nor out of reach.
        let mut errors: Vec<f64> = sweep.iter().map(|(.., error)| *error).collect();
        errors.sort_by(f64::total_cmp);
        let limit = (errors[errors.len() / 5] * 1e3).ceil() / 1e3;
        let answer = self.plan(subject, limit, &scene.name)?;
        sweep.retain(|(.., error)| *error <= limit);
        sweep.sort_by(|a, b| a.1.total_cmp(&b.1));
        // The sweep's times are of one frame or a few: its fastest are timed again, in turns with the answer.
        let fastest: Vec<&Settings> = sweep.iter().take(4).map(|(settings, ..)| settings).collect();
        let all: Vec<Settings> = std::iter::once(&answer.choice.settings).chain(fastest).cloned().collect();
        let timed =
            bench.times(&all, std::slice::from_ref(&seen), ROUNDS, Instant::now() + Duration::from_secs(600))?;
        let ms: Vec<f64> = timed.iter().map(|(timings, _)| timings.frame_gpu_ms().median).collect();
        let best = (1..all.len()).min_by(|a, b| ms[*a].total_cmp(&ms[*b])).ok_or("nothing holds")?;
        let error = sweep[best - 1].2;
        let row = bench.row(&answer.choice.settings, &seen)?;
        let own_error = bench.judge(&row, &reference)?.error;
        let words = |settings: &Settings| {
            let entries = settings.entries();
            let of = |key: &str| entries.iter().find(|entry| entry.0.name == key).map_or("", |entry| &entry.1);
            let own = match settings.method.name() {
                "rays" => format!(", {} rays", of("rays.diffuse")),
                "lpv" => format!(", {} cells", of("lpv.edge")),
                _ => String::new(),
            };
            let (gather, interleave, samples) =
                (of("image.gather_resolution"), of("image.interleave"), of("image.samples"));
            format!("{}{own}, {gather}, interleave {interleave}, {samples} samples", settings.method)
        };
        let ratio = ms[0] / ms[best];
        let cpu_s = answer.measuring_cpu_s.unwrap_or(f64::NAN);
        Ok(vec![
            scene.name.clone(),
            limit.to_string(),
            words(&all[0]),
            format!("{:.1}", ms[0]),
            format!("{own_error:.4}"),
            words(&all[best]),
            format!("{:.1}", ms[best]),
            format!("{error:.4}"),
            format!("{ratio:.2}"),
            format!("{} of {}", answer.measured, errors.len()),
            format!("{cpu_s:.0} of {:.0}", swept.cpu_s),
        ])
    }

    /// The answer of the program without anything stored: neither rows nor pipelines.
    fn plan(&self, subject: &Subject, limit: f64, name: &str) -> Result<Answer> {
        let caches = subject.folder.join(name);
        let json = caches.with_extension("json");
        let mut command = Command::new(&self.program);
        command.env("XDG_CACHE_HOME", &caches).env("TWOBOUNCE_CACHE", &caches).arg("plan").arg(subject.path);
        let size = format!("{}x{}", SIZE.0, SIZE.1);
        command.args(["--size", &size, "--max-error", &limit.to_string(), "--budget", "1h", "-q"]);
        command.args(["--default-light", "off", "--methods", &METHODS.join(","), "--json"]).arg(&json);
        command.args((subject.sky > 0.0).then(|| format!("--sky={0},{0},{0}", subject.sky)));
        command.args(FIXED.iter().flat_map(|set| ["--set", set]));
        let status = command.status()?;
        if status.code() != Some(0) {
            eprintln!("{}: {status}", subject.path.display());
        }
        Ok(serde_json::from_slice(&std::fs::read(json)?)?)
    }
}

/// A box of a scene: centre and size in metres, colour, and emission.
type SceneBox = ([f32; 3], [f32; 3], [f32; 3], f32);

/// Houses on a plain, lit by a sun and a sky.
pub fn exterior_scene() -> twobounce::Result<Vec<u8>> {
    let mut blocks: Vec<SceneBox> = vec![([0.0, -0.25, 0.0], [24.0, 0.5, 24.0], [0.5, 0.5, 0.45], 0.0)];
    for i in 0..9u8 {
        let (x, z, h) = (f32::from(i % 3) * 5.0 - 5.0, f32::from(i / 3) * 5.0 - 5.0, 1.5 + f32::from(i * 7 % 5));
        blocks.push(([x, 0.5 * h, z], [2.5, h, 2.5], [0.8 - 0.06 * f32::from(i), 0.6, 0.3 + 0.05 * f32::from(i)], 0.0));
    }
    let sun = "type = 'directional', intensity = 3.0";
    scene("exterior", &blocks, &format!("rotation = [-0.35, 0.25, 0.1, 0.9]\nlight = {{ {sun} }}"), [0.0, 6.0, 17.0])
}

/// A hall with 64 lamps below its ceiling.
fn lamps_scene() -> twobounce::Result<Vec<u8>> {
    let mut blocks: Vec<SceneBox> = vec![
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
    scene("lamps", &blocks, "light = { type = 'point', intensity = 1.0 }", [0.0, 2.0, 9.0])
}

/// A description like those of the scenes in `assets/`: boxes, a light, and a camera that looks along −Z and a little
/// down.
fn scene(name: &str, blocks: &[SceneBox], light: &str, eye: [f32; 3]) -> twobounce::Result<Vec<u8>> {
    let (mut materials, mut nodes) = (String::new(), String::new());
    for (i, (center, size, [r, g, b], emits)) in blocks.iter().enumerate() {
        let glow = if *emits > 0.0 { [1.0, 0.9, 0.7] } else { [0.0; 3] };
        materials += &format!(
            "[[materials]]\nname = '{i}'\nemissiveFactor = {glow:?}\n\
             pbrMetallicRoughness = {{ baseColorFactor = [{r}, {g}, {b}, 1.0], metallicFactor = 0.0, roughnessFactor = 1.0 }}\n\
             extensions.KHR_materials_emissive_strength.emissiveStrength = {:?}\n",
            emits.max(1.0)
        );
        nodes += &format!(
            "[[nodes]]\nname = '{i}'\nmaterial = '{i}'\ntranslation = {center:?}\nscale = {size:?}\n\
             shape.boxes = {{ corners = [[[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]] }}\n"
        );
    }
    nodes += &format!("[[nodes]]\nname = 'light'\ntranslation = [0.0, 3.2, 3.0]\n{light}\n");
    nodes += &format!(
        "[[nodes]]\nname = 'camera'\nfov = 45.8366\ntranslation = {eye:?}\nrotation = [-0.1, 0.0, 0.0, 0.995]\n"
    );
    make(name, &(materials + &nodes))
}
