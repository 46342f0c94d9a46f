//! What a frame does and takes, for scenes of different kinds: passes, pipelines, bytes, and what no pass asks for; then what one
//! thing added to the first scene adds to its frame.
//!
//! `cargo run --release --example audit [SCENE.glb…]`, by default scenes in `assets/`

mod kinds;

use std::path::PathBuf;

use twobounce::Result;
use twobounce::profile::audit::Audit;
use twobounce::renderer::{Context, ContextOptions, RenderOptions};
use twobounce::scene::{LoadOptions, Scene, Still, View};
use twobounce::settings::Settings;

const SCENES: [&str; 3] = ["assets/cornell-point.glb", "assets/gallery.glb", "assets/demo.glb"];
const PRESETS: [&str; 6] = ["none", "fast", "balanced", "cones", "lpv", "photons"];

fn main() -> Result<()> {
    let named: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let paths = if named.is_empty() { SCENES.map(PathBuf::from).to_vec() } else { named };
    let load = |path: &PathBuf| Scene::load(path, &LoadOptions::default());
    let scenes = paths.iter().map(load).collect::<Result<Vec<_>>>()?;
    println!(
        "| scene | preset | passes | pipelines made, used | MiB | nothing asks for |\n|---|---|---|---:|---:|---|"
    );
    let mut plain = Vec::new();
    for (i, scene) in scenes.iter().enumerate() {
        for preset in PRESETS {
            let audit = audit(scene, preset)?;
            let passes: Vec<&str> = audit.passes.iter().map(|pass| pass.name).collect();
            let mib = audit.bytes() as f64 / f64::from(1 << 20);
            let (passes, superfluous) = (passes.join(", "), or_dash(&audit.superfluous()));
            let (name, made, used) = (&scene.name, audit.pipelines, audit.used.len());
            println!("| {name} | {preset} | {passes} | {made}, {used} | {mib:.1} | {superfluous} |");
            if i == 0 {
                plain.push(audit);
            }
        }
    }
    println!("\n| added to {} | preset | adds |\n|---|---|---|", scenes[0].name);
    for kind in kinds::kinds(&scenes[0]) {
        let mut added: Vec<(String, Vec<&str>)> = Vec::new();
        for (preset, plain) in PRESETS.iter().zip(&plain) {
            let audit = audit(&kind, preset)?;
            let words = or_dash(&[audit.beside(plain), audit.superfluous()].concat());
            match added.iter_mut().find(|(other, _)| *other == words) {
                Some((_, presets)) => presets.push(preset),
                None => added.push((words, vec![preset])),
            }
        }
        for (words, presets) in added {
            let presets = if presets.len() == PRESETS.len() { "all".to_owned() } else { presets.join(", ") };
            println!("| {} | {presets} | {words} |", kind.name);
        }
    }
    Ok(())
}

fn or_dash(words: &[String]) -> String {
    if words.is_empty() { "–".to_owned() } else { words.join("; ") }
}

fn audit(scene: &Scene, preset: &str) -> Result<Audit> {
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
    let mut settings = Settings::preset(if preset == "none" { "fast" } else { preset })?;
    settings.set("voxels=32")?;
    if preset == "none" {
        settings.set("method=none")?;
    }
    // A device of its own, so that every pipeline is counted.
    let context = Context::new(&ContextOptions::default())?;
    Audit::of(&context, Still::new(scene, &pose, &view), &settings, RenderOptions::new((64, 64), bounds))
}
