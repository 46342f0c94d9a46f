//! The table of `docs/devices.md`: the presets that run on devices known from documents. `cargo run --release --example
//! pages -- devices` writes it, and a test compares it.

use std::fs;
use std::path::Path;

use twobounce::frame::FrameDesc;
use twobounce::lab::table::markdown;
use twobounce::renderer::{fits, lacks};
use twobounce::scene::{LoadOptions, Scene};
use twobounce::settings::{PRESETS, Settings};
use twobounce::vk::{Described, DeviceReport};
use twobounce::{Error, Result};

/// The folder of the descriptions, from the project's root.
pub const PROFILES: &str = "tests/profiles";
const SCENE: &str = "assets/gallery.glb";
const SIZE: (u32, u32) = (1280, 720);

/// Every description, in the order of their names.
///
/// # Errors
/// A message about a file that is not a description.
pub fn described(root: &Path) -> Result<Vec<Described>> {
    let folder = root.join(PROFILES);
    let entries = fs::read_dir(&folder).map_err(|error| Error::file(&folder, error.to_string()))?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let text = fs::read_to_string(path).map_err(|error| Error::file(path, error.to_string()))?;
        toml::from_str(&text).map_err(|error| Error::file(path, error.to_string()))
    };
    paths.iter().map(read).collect()
}

/// The table of that name.
///
/// # Errors
/// A message about a description, or about a name that no table has.
pub fn table(name: &str, root: &Path) -> Result<String> {
    let described = described(root)?;
    match name {
        "devices" => devices(&described, root),
        "sources" => {
            let row = |device: &Described| [device.name.clone(), device.driver.clone(), device.source.clone()];
            Ok(markdown(["device", "driver", "numbers from"], "-", described.iter().map(row)))
        }
        _ => Err(Error::Usage(format!("there is no table {name}: devices and sources are"))),
    }
}

fn devices(described: &[Described], root: &Path) -> Result<String> {
    let scene = Scene::load(&root.join(SCENE), &LoadOptions::default())?;
    let mut rows = vec![];
    for device in described {
        let report = device.report()?;
        let memory = format!("{} of {} GiB", memory(&report, &scene), device.memory_gib);
        rows.push([device.name.clone(), runs(&report), missing(&report), memory]);
    }
    Ok(markdown(["device", "presets that run", "what others lack", "presets that fit"], "-", rows))
}

fn names(presets: &[&str]) -> String {
    match presets.len() {
        0 => "none".to_owned(),
        all if all == PRESETS.len() => "all".to_owned(),
        _ => presets.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
    }
}

fn runs(device: &DeviceReport) -> String {
    let run = PRESETS.iter().filter(|preset| lacks(device, &(preset.settings)()).is_empty());
    names(&run.map(|preset| preset.name).collect::<Vec<_>>())
}

/// Each missing requirement, with the presets that need it.
fn missing(device: &DeviceReport) -> String {
    let mut needed: Vec<(String, Vec<&str>)> = vec![];
    for preset in PRESETS {
        for name in lacks(device, &(preset.settings)()) {
            match needed.iter_mut().find(|(known, _)| *known == name) {
                Some((_, presets)) => presets.push(preset.name),
                None => needed.push((name, vec![preset.name])),
            }
        }
    }
    let words = needed.iter().map(|(name, presets)| format!("{name} ({})", names(presets)));
    let words: Vec<String> = words.collect();
    if words.is_empty() { "–".to_owned() } else { words.join("; ") }
}

/// The presets whose frame of the scene fits the memory of a device and the largest buffer that it binds.
fn memory(device: &DeviceReport, scene: &Scene) -> String {
    let pose = scene.pose(None, 0.0);
    let fit = |settings: &Settings| {
        let bounds = scene.bounds(None);
        let desc = FrameDesc { scene, settings, size: SIZE, outputs: 1, bounds, slots: 1, waits: true, query: None };
        fits(device, &desc, &pose).is_ok()
    };
    let fitting = PRESETS.iter().filter(|preset| fit(&(preset.settings)()));
    names(&fitting.map(|preset| preset.name).collect::<Vec<_>>())
}
