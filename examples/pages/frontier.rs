//! Measures the rows of `docs/notes/frontier.md`: every method with the same number of settings, on scenes of
//! different kinds.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use glam::Vec3;
use twobounce::chart::measure::{ChartScene, Images, ReferenceImage};
use twobounce::chart::row::Row;
use twobounce::chart::suite::Suite;
use twobounce::ground::grid_choice::for_camera;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::{CsvRow, fill_file, from_csv, to_csv};
use twobounce::layers::Aov;
use twobounce::measure::timing::Count;
use twobounce::output::exr::Metadata;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

use crate::frontier_tables::{BUDGETS_S, COMMON, METHODS, PAGE, ROWS, Rows};
use crate::plan::exterior_scene;

#[derive(Args)]
pub struct Frontier {
    /// The scenes to measure: names of the suite, `exterior`, or `atrium`; rows that are there stay. Without scenes the
    /// tables are filled
    scenes: Vec<String>,
    /// The file of the scene `atrium`, which is not part of the project
    #[arg(long)]
    atrium: Option<PathBuf>,
    /// No further row is begun after this time
    #[arg(long, default_value = "60")]
    minutes: f64,
}

const SIDE: u32 = 128;

/// The timed frames of a row; each rebuilds lists and light as after motion.
const FRAMES: Count = Count { warm_up: 1, least: 2, most: 3, enough_ms: 1000.0 };

const COLUMNS: [&str; 14] = [
    "scene",
    "method",
    "settings",
    "driver",
    "frame_cpu_ms",
    "frame_gpu_ms",
    "memory_bytes",
    "diffuse_rel",
    "diffuse_energy",
    "total_rel",
    "total_energy",
    "noise_in_diffuse_rel",
    "noise_in_total_rel",
    "failure",
];

impl Frontier {
    pub fn run(&self) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let path = root.join(ROWS);
        let end = Instant::now() + Duration::from_secs_f64(60.0 * self.minutes);
        let mut rows: Vec<CsvRow> = match std::fs::read_to_string(&path) {
            Ok(text) => from_csv(&text)?.1,
            Err(_) => Vec::new(),
        };
        let context = Context::new(&ContextOptions::default())?;
        for name in &self.scenes {
            let scene = self.open(root, name)?;
            for (method, tried) in METHODS {
                for tried in tried {
                    let is_it = |row: &&CsvRow| {
                        ["scene", "method", "settings"].map(|column| row.cell(column)) == [name.as_str(), method, tried]
                    };
                    if !rows.iter().any(|row| is_it(&row)) {
                        if Instant::now() > end {
                            println!("the time is over; the same command goes on");
                            return Ok(());
                        }
                        let cells = measured(&context, &scene, [name, method, tried])?;
                        println!("{}", cells.join(", "));
                        rows.extend(from_csv(&to_csv([COLUMNS.map(str::to_owned), cells]))?.1);
                        let lines = rows.iter().map(|row| COLUMNS.map(|column| row.cell(column).to_owned()));
                        std::fs::write(&path, to_csv(std::iter::once(COLUMNS.map(str::to_owned)).chain(lines)))?;
                    }
                    // The settings that follow take longer still.
                    let ms = rows.iter().find(is_it).and_then(|row| row.number("frame_cpu_ms"));
                    if ms.is_some_and(|ms| ms > 1e3 * BUDGETS_S[BUDGETS_S.len() - 1]) {
                        break;
                    }
                }
            }
        }
        if self.scenes.is_empty() {
            let rows = Rows::read(root)?;
            fill_file(&root.join(PAGE), |name, _| rows.table(name))?;
        }
        Ok(())
    }

    /// A scene with its reference of all light.
    fn open(&self, root: &Path, name: &str) -> Result<ChartScene> {
        let suite = Suite::read(&root.join("suite"))?;
        if let Ok([entry]) = suite.named(&[name.to_owned()]).as_deref() {
            return Ok(chart_scene(name, Specimen::load(suite.path(entry))?, suite.reference(entry, SIDE)?));
        }
        let (specimen, noise) = match (&self.atrium, name) {
            (Some(path), "atrium") => (Specimen::load(path)?, 0.05),
            (None, "atrium") => return Err(Error::Usage("name the atrium's file with --atrium".into())),
            (_, "exterior") => {
                let file = tempfile::Builder::new().suffix(".glb").tempfile().expect("a temporary file");
                std::fs::write(file.path(), exterior_scene()?).expect("a temporary file");
                let mut specimen = Specimen::load(file.path())?;
                specimen.scene.sky += Vec3::splat(0.5);
                (specimen, 0.01)
            }
            _ => {
                return Err(Error::Usage(format!(
                    "there is no scene {name}: those of the suite, exterior and atrium are"
                )));
            }
        };
        let (depth, stop) = (Depth::Full, Stop::Noise(noise));
        let options = Options { width: SIDE, height: SIDE, depth, stop, seed: 0, occlusion: false };
        let film = Cache::of_user().render(specimen.still(), &options, &|_| (), &AtomicBool::new(false))?;
        println!("{name}: a reference of {} paths a pixel", film.paths() / u64::from(SIDE * SIDE));
        Ok(chart_scene(name, specimen, ReferenceImage::of_film(depth, &film)?))
    }
}

fn chart_scene(name: &str, specimen: Specimen, reference: ReferenceImage) -> ChartScene {
    let options = specimen.options((SIDE, SIDE));
    let Specimen { scene, pose, view } = specimen;
    let (camera, command, references) = (String::new(), String::new(), vec![reference]);
    ChartScene {
        name: name.to_owned(),
        scene,
        pose,
        view,
        camera,
        options,
        references,
        command,
        header: Metadata::new(),
    }
}

/// The cells of a row. `names`: the scene, the method and the settings.
fn measured(context: &Arc<Context>, scene: &ChartScene, names: [&str; 3]) -> Result<[String; COLUMNS.len()]> {
    let mut words = names[2].split(' ');
    let preset = words.next().unwrap_or_default();
    let mut settings = Settings::preset(preset)?;
    COMMON.into_iter().chain(words).try_for_each(|change| settings.set(change))?;
    let row = Row::of_settings(preset, &[], settings.clone());
    let mut cells: [String; COLUMNS.len()] = Default::default();
    cells[..3].clone_from_slice(&names.map(str::to_owned));
    cells[3] = context.driver.clone();
    let image = || {
        let settings = for_camera(&settings, scene.still(), scene.options.bounds);
        let options = RenderOptions { aovs: vec![Aov::Direct], ..scene.options.clone() };
        let mut renderer = Renderer::new(context, scene.scene.clone(), &scene.pose, settings, options)?;
        renderer.render(&scene.pose, &scene.view)?;
        let images = Images { whole: renderer.read(), equal: None };
        let timings = FRAMES.frames(&mut renderer, &scene.pose, &scene.view, &|| Ok(()))?;
        Ok::<_, Error>((scene.judge(&row, &images)?.0[0], timings, renderer.plan().total()))
    };
    match image() {
        Ok((errors, timings, memory_bytes)) => {
            let metrics = errors.metrics;
            let diffuse = metrics.diffuse;
            let noise = errors.noise_in_rel;
            let numbers = [
                timings.frame_cpu_ms().map(|ms| ms.median),
                Some(timings.frame_gpu_ms().median),
                Some(memory_bytes as f64),
                diffuse.map(|diffuse| diffuse.rel),
                diffuse.map(|diffuse| diffuse.energy),
                Some(metrics.total.rel),
                Some(metrics.total.energy),
                noise.diffuse,
                Some(noise.total),
            ];
            for (cell, number) in cells[4..].iter_mut().zip(numbers) {
                *cell = number.map_or(String::new(), |number| format!("{number:.4}"));
            }
        }
        Err(error) => cells[COLUMNS.len() - 1] = error.to_string(),
    }
    Ok(cells)
}
