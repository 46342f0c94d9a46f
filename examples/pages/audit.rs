//! The passes, pipelines and bytes of a frame, and those that no pass uses, for scenes of different kinds. Then the
//! pipelines and bytes that one further object in the first scene adds to its frame.

use std::path::PathBuf;

use twobounce::Result;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::{MISSING, markdown};
use twobounce::profile::audit::Audit;
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

use crate::kinds::kinds;

const PRESETS: [&str; 6] = ["none", "fast", "balanced", "cones", "lpv", "photons"];

pub fn run(paths: &[PathBuf]) -> Result<()> {
    let scenes = paths.iter().map(Specimen::load).collect::<Result<Vec<_>>>()?;
    let (mut rows, mut plain) = (Vec::new(), Vec::new());
    for (i, specimen) in scenes.iter().enumerate() {
        for preset in PRESETS {
            let audit = audit(specimen, preset)?;
            let passes: Vec<String> = audit.passes.iter().map(|pass| pass.name.to_owned()).collect();
            let pipelines = format!("{}, {}", audit.pipelines, audit.used.len());
            let mib = format!("{:.1}", audit.bytes() as f64 / f64::from(1 << 20));
            let (name, superfluous) = (specimen.scene.name.clone(), or_dash(&audit.superfluous()));
            rows.push([name, preset.to_owned(), passes.join(", "), pipelines, mib, superfluous]);
            if i == 0 {
                plain.push(audit);
            }
        }
    }
    let head = ["scene", "preset", "passes", "pipelines made, used", "MiB", "nothing asks for"];
    println!("{}", markdown(head, "---::-", rows));
    let mut rows = Vec::new();
    for kind in kinds(&scenes[0].scene) {
        let mut added: Vec<(String, Vec<&str>)> = Vec::new();
        let kind = Specimen::new(kind);
        for (preset, plain) in PRESETS.iter().zip(&plain) {
            let audit = audit(&kind, preset)?;
            let words = or_dash(&[audit.beside(plain), audit.superfluous()].concat());
            match added.iter_mut().find(|(other, _)| *other == words) {
                Some((_, presets)) => presets.push(preset),
                None => added.push((words, vec![preset])),
            }
        }
        rows.extend(added.into_iter().map(|(words, presets)| {
            let presets = if presets.len() == PRESETS.len() { "all".to_owned() } else { presets.join(", ") };
            [kind.scene.name.clone(), presets, words]
        }));
    }
    print!("{}", markdown([&*format!("added to {}", scenes[0].scene.name), "preset", "adds"], "-", rows));
    Ok(())
}

fn or_dash(words: &[String]) -> String {
    if words.is_empty() { MISSING.to_owned() } else { words.join("; ") }
}

fn audit(specimen: &Specimen, preset: &str) -> Result<Audit> {
    let mut settings = Settings::preset(if preset == "none" { "fast" } else { preset })?;
    settings.set("voxels=32")?;
    if preset == "none" {
        settings.set("method=none")?;
    }
    // A new device, so that every pipeline is counted.
    let context = Context::new(&ContextOptions::default())?;
    Audit::of_frame(&context, specimen.still(), &settings, specimen.options((64, 64)))
}
