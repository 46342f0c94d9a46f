//! Targets of fuzzing: all kinds of files that the program reads, by the endings of their names.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use twobounce::Error;
use twobounce::chart::export::Chart;
use twobounce::chart::outline::Outline;
use twobounce::chart::row::Row;
use twobounce::lab::merge::merge;
use twobounce::lab::store::{Store, Stored};
use twobounce::layers::Layers;
use twobounce::measure::metrics;
use twobounce::measure::picture::side_by_side;
use twobounce::measure::terms::Subtract;
use twobounce::memory::Limit;
use twobounce::output::exr::Metadata;
use twobounce::reference::cache::Cache;
use twobounce::reference::part::Part;
use twobounce::reference::{Depth, Options, Progress, Stop};
use twobounce::scene::{LoadOptions, Scene, Still, View, sky};
use twobounce::settings::Settings;
use twobounce::stability::markdown;

use crate::follow;
use crate::valid::assert_valid;
use crate::worker::wrong_sentence;

/// Bytes that loading may take by its own count; the guard allows for the rest.
const LOAD_BYTES: u64 = 64 << 20;

pub struct FuzzTarget {
    pub name: &'static str,
    /// Endings of its files in the corpus.
    pub endings: &'static [&'static str],
    /// Its share of the inputs in twentieths.
    pub share: usize,
    /// Whether every refusal begins with the file's name.
    pub names_file: bool,
    pub run: fn(&Input) -> Outcome,
}

/// A file in a folder of its own.
pub struct Input<'a> {
    pub folder: &'a Path,
    pub path: &'a Path,
    pub bytes: &'a [u8],
    /// A random number that depends on the bytes alone, and chooses how the file is used.
    pub choice: u64,
}

/// The file's result in words that change when something new happens, or the reason of its refusal.
pub type Outcome = Result<String, String>;

pub const TARGETS: [FuzzTarget; 10] = [
    FuzzTarget { name: "scene", endings: &["glb", "gltf"], share: 10, names_file: true, run: scene },
    FuzzTarget { name: "stream", endings: &["stream.glb"], share: 2, names_file: true, run: scene },
    FuzzTarget { name: "texture", endings: &["png", "jpg", "webp", "ktx2"], share: 4, names_file: true, run: texture },
    FuzzTarget { name: "map", endings: &["hdr", "exr"], share: 2, names_file: true, run: map },
    FuzzTarget { name: "settings", endings: &["toml"], share: 1, names_file: false, run: settings },
    FuzzTarget { name: "table", endings: &["csv"], share: 1, names_file: false, run: table },
    FuzzTarget { name: "row", endings: &["row"], share: 1, names_file: false, run: row },
    FuzzTarget { name: "film", endings: &["film"], share: 1, names_file: false, run: film },
    FuzzTarget { name: "outline", endings: &["outline"], share: 1, names_file: false, run: outline },
    FuzzTarget { name: "part", endings: &["part"], share: 1, names_file: false, run: part },
];

/// The target for a file's name.
pub fn index_of(path: &Path) -> Option<usize> {
    let ending = path.extension()?.to_str()?;
    let name = path.file_name()?.to_str()?;
    let streams = ["draco", "meshopt"].iter().any(|format| name.contains(format));
    let ending = if streams && ending == "glb" { "stream.glb" } else { ending };
    TARGETS.iter().position(|target| target.endings.contains(&ending))
}

fn options(choice: u64) -> LoadOptions {
    LoadOptions {
        strict: choice >> 32 & 1 == 1,
        memory: Some(Limit { bytes: LOAD_BYTES, words: "the test's limit".into() }),
        max_texture: (choice >> 33 & 3 == 0).then_some(8),
        ..LoadOptions::default()
    }
}

fn scene(input: &Input) -> Outcome {
    loaded(input.path, input.choice)
}

fn loaded(path: &Path, choice: u64) -> Outcome {
    let scene = Scene::load(path, &options(choice)).map_err(|e| e.to_string())?;
    assert_valid(&scene);
    for note in &scene.warnings {
        assert_eq!(wrong_sentence(note, None), None, "in the note {note:?}");
    }
    let few = |count: usize| count.min(3);
    let counts = [scene.nodes.len(), scene.meshes.len(), scene.images.len(), scene.lights.len(), scene.cameras.len()];
    let slots = scene.materials.iter().map(|material| material.texture_slots().count()).sum();
    let more = [scene.instances.len(), scene.animations.len(), scene.materials.len(), slots];
    let shape = format!("{:?} {:?} {}", counts.map(few), more.map(few), scene.warnings.join("|"));
    follow::scene(scene, choice);
    Ok(shape)
}

/// A triangle whose texture is the file, in slots of both colour spaces.
fn texture(input: &Input) -> Outcome {
    let name = input.path.file_name().unwrap_or_default().to_string_lossy();
    let scene = input.folder.join(format!("of-{name}.gltf"));
    if !scene.exists() {
        let text = include_str!("textured.gltf").replace("IMAGE", &name);
        std::fs::write(&scene, text).map_err(|e| e.to_string())?;
    }
    loaded(&scene, input.choice)
}

/// Reads the file as a sky, and as an image to compare.
fn map(input: &Input) -> Outcome {
    if input.path.extension().is_some_and(|ending| ending == "exr") && input.choice & 1 == 0 {
        return picture(input.path);
    }
    let (panorama, notes) = sky::read(input.path, (input.choice & 2 == 0).then_some(16)).map_err(|e| e.to_string())?;
    let mut scene = Scene::empty("map");
    let shape = format!("{} {}", panorama.width.ilog2(), notes.join("|"));
    // Large maps take seconds, which is no fault.
    if panorama.radiance.len() <= 1 << 12 && input.choice >> 40 & 15 == 0 {
        scene.set_sky_map(panorama, 1.5, 30.0);
        let pose = scene.pose(None, 0.0);
        follow::trace(&scene, &pose, &View::framing(scene.bounds(None)));
    }
    Ok(shape)
}

fn picture(path: &Path) -> Outcome {
    let (layers, metadata) = Layers::read_exr(path).map_err(|e| e.to_string())?;
    let shape = format!("{:?}", layers.layers.iter().map(|layer| layer.0).collect::<Vec<_>>());
    // Only small images are compared pixel by pixel.
    if layers.beauty().len() > 1 << 12 {
        return Ok(shape);
    }
    let mut other = layers.clone();
    other.layers[0].1.iter_mut().for_each(|pixel| *pixel = (1.5 * Vec3::from(*pixel) + 0.1).into());
    for (image, reference) in [(&layers, &other), (&other, &layers)] {
        if let Ok(comparison) = metrics::compare(image, reference, Subtract::Own) {
            side_by_side(image, reference, &comparison).map_err(|e| e.to_string())?;
        }
    }
    let copy = path.with_file_name("copy.exr");
    layers.write_exr(&copy, &metadata).and_then(|()| Layers::read_exr(&copy)).expect("what was read can be written");
    layers.write_exr(&copy, &Metadata::new()).expect("without metadata too");
    Ok(shape)
}

fn settings(input: &Input) -> Outcome {
    let Ok(text) = std::str::from_utf8(input.bytes) else { return Ok("no text".into()) };
    let mut settings = Settings::default();
    settings.merge_toml(text).map_err(|e| e.to_string())?;
    let written = settings.to_toml();
    let mut again = Settings::default();
    again.merge_toml(&written).expect("what was written can be read");
    assert_eq!(again.to_toml(), written, "settings change when they are written and read");
    follow::settings(&settings);
    Ok(format!("{} {}", settings.method, written.lines().count()))
}

fn table(input: &Input) -> Outcome {
    let Ok(text) = std::str::from_utf8(input.bytes) else { return Ok("no text".into()) };
    markdown::page(text).map(|page| format!("{} lines", page.lines().count()))
}

/// The valid files of a chart's folder, to which damaged ones are added.
const ROW: &[u8] = include_bytes!("corpus/kept.row");
const OUTLINE: &[u8] = include_bytes!("corpus/kept.outline");

/// Makes a chart's folder of an outline and a row.
fn chart_folder(folder: &Path, outline: &[u8], row: &[u8]) -> Result<(), String> {
    let text = |e: std::io::Error| e.to_string();
    std::fs::create_dir_all(folder.join("rows")).map_err(text)?;
    let mark = "Made by `twobounce chart`, which rewrites everything here and continues with the rows in rows/.\n";
    let files: [(&str, &[u8]); 3] = [("chart.txt", mark.as_bytes()), ("outline.toml", outline), ("rows/key.toml", row)];
    files.iter().try_for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes)).map_err(text)
}

thread_local! {
    // Opening a store reads the whole program file.
    static MERGED: std::cell::RefCell<Option<Store<Row>>> = const { std::cell::RefCell::new(None) };
}

/// Merges the folder of a chart's part with a valid one, as `twobounce merge` does, and writes the chart's files.
fn merged(input: &Input, outline: &[u8], row: &[u8]) -> Outcome {
    let folders = ["damaged", "whole"].map(|name| input.folder.join(name));
    chart_folder(&folders[0], outline, row)?;
    chart_folder(&folders[1], OUTLINE, ROW)?;
    let folders = [folders[0].as_path(), folders[1].as_path()];
    let mut outline = Store::<Row>::outline::<Outline>(folders[0]).map_err(|e| e.to_string())?;
    outline.unite(Store::<Row>::outline(folders[1]).map_err(|e| e.to_string())?)?;
    let order: Vec<String> = outline.rows.iter().map(|row| row.address.clone()).collect();
    let merged = merge::<Row>(&folders, &order).map_err(|e| e.to_string())?;
    let shape = format!("{} rows, {} twice, {} missing", merged.rows.len(), merged.twice, merged.missing);
    MERGED.with_borrow_mut(|store| {
        let output = input.folder.join("merged");
        let store = store.get_or_insert_with(|| Store::open(&output, true).expect("the folder is a chart's"));
        merged.save(store).map_err(|e| e.to_string())?;
        let chart = Chart { outline, rows: merged.rows, planned: 2, with_history: true, ..Chart::default() };
        chart.write(store).map_err(|e| e.to_string())?;
        // Its own rows and history would count in the next merge.
        for folder in ["rows", "history"] {
            let _ = std::fs::remove_dir_all(output.join(folder));
        }
        Ok(shape)
    })
}

/// The description of a chart in a folder that is merged.
fn outline(input: &Input) -> Outcome {
    merged(input, input.bytes, ROW)
}

/// A stored row of a chart, in the folder that a chart continues or in one that is merged. A damaged row is left out.
fn row(input: &Input) -> Outcome {
    if input.choice & 1 == 0 {
        return merged(input, OUTLINE, input.bytes);
    }
    let folder = input.folder.join("chart");
    chart_folder(&folder, OUTLINE, input.bytes)?;
    thread_local! { static STORE: std::cell::RefCell<Option<Store<Row>>> = const { std::cell::RefCell::new(None) } }
    let stored: Option<Stored<Row>> = STORE.with_borrow_mut(|store| {
        let store = store.get_or_insert_with(|| Store::open(&folder, true).expect("the folder is a chart's"));
        store.load("key")
    });
    let Some(stored) = stored else { return Ok("none".into()) };
    let scene = stored.row.scene.clone();
    let chart = Chart { planned: 1, rows: vec![stored], ..Chart::default() };
    let (lines, panels) = (chart.csv().lines().count(), chart.panels(&scene));
    twobounce::chart::svg::chart(&panels, 2);
    twobounce::chart::page::html(&chart, &[]);
    Ok(format!("{lines} lines"))
}

/// Some of the samples of a reference, alone and with the following samples.
fn part(input: &Input) -> Outcome {
    let damaged = Part::read(input.path).map_err(|e| e.to_string())?;
    let whole = Part::decode(include_bytes!("corpus/second.part")).expect("the corpus holds a whole one");
    let mut shape = format!("{} {}", damaged.samples(), damaged.about.layers.len());
    let (image, header) = damaged.image();
    let copy = input.path.with_file_name("copy.exr");
    image.write_exr(&copy, &header).map_err(|e| e.to_string())?;
    match Part::merge(vec![("damaged".into(), damaged), ("whole".into(), whole)]) {
        Ok(both) => {
            both.write(&copy.with_extension("part")).map_err(|e| e.to_string())?;
            both.image().0.write_exr(&copy, &both.image().1).map_err(|e| e.to_string())?;
            shape += " and the rest";
        }
        Err(e) if wrong_sentence(&e.to_string(), None).is_some() => return Err(e.to_string()),
        Err(_) => {}
    }
    Ok(shape)
}

/// A stored film of [`film_of`]. A damaged film is traced again.
fn film(input: &Input) -> Outcome {
    let (scene, mut options) = film_of();
    if input.choice & 1 == 0 {
        options.stop = Stop::Noise(0.01);
    }
    let (pose, view) = (scene.pose(None, 0.0), View::framing(scene.bounds(None)));
    let key = twobounce::reference::cache::key(Still::new(&scene, &pose, &view), &options);
    let folder = input.folder.join("films");
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    std::fs::write(folder.join(format!("{}.film", key.to_hex())), input.bytes).map_err(|e| e.to_string())?;
    // A film that states little noise may ask for any number of samples: it is enough that tracing continues.
    let enough = AtomicBool::new(false);
    let progress = |now: Progress| enough.store(now.paths > now.before + 1000, Ordering::Relaxed);
    let film = match Cache::at(&folder).render(Still::new(&scene, &pose, &view), &options, &progress, &enough) {
        Err(Error::Interrupted) => return Ok("goes on".into()),
        film => film.map_err(|e| e.to_string())?,
    };
    Ok(format!("{} {}", film.done() == 4, film.history.len()))
}

/// Scene and options of the films of the corpus.
pub fn film_of() -> (Scene, Options) {
    let options =
        Options { width: 4, height: 4, depth: Depth::Full, stop: Stop::Samples(4), seed: 0, occlusion: false };
    (Scene { sky: Vec3::ONE, ..Scene::empty("film") }, options)
}
