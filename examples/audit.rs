//! What a frame does and takes, for scenes of different kinds: passes, pipelines, bytes, and what no pass asks for.
//!
//! `cargo run --release --example audit [SCENE.glb…]`, by default the scenes in `assets/`

use std::path::PathBuf;

use twobounce::Result;
use twobounce::profile::audit::Audit;
use twobounce::renderer::{Context, ContextOptions, RenderOptions};
use twobounce::scene::{LoadOptions, Scene, View};
use twobounce::settings::Settings;

const SCENES: [&str; 3] = ["assets/cornell-point.glb", "assets/cornell-area.glb", "assets/gallery.glb"];
const PRESETS: [&str; 5] = ["fast", "balanced", "cones", "lpv", "photons"];

fn main() -> Result<()> {
    let named: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let scenes = if named.is_empty() { SCENES.map(PathBuf::from).to_vec() } else { named };
    println!(
        "| scene | preset | passes | pipelines made, used | MiB | nothing asks for |\n|---|---|---|---:|---:|---|"
    );
    for path in scenes {
        let scene = Scene::load(&path, &LoadOptions::default())?;
        let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
        let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
        for preset in ["none"].iter().chain(&PRESETS) {
            let mut settings = Settings::preset(if *preset == "none" { "fast" } else { preset })?;
            settings.set("voxels=32")?;
            if *preset == "none" {
                settings.set("method=none")?;
            }
            // A device of its own, so that every pipeline is counted.
            let context = Context::new(&ContextOptions::default())?;
            let audit = Audit::of(&context, (&scene, &pose, &view), &settings, RenderOptions::new((64, 64), bounds))?;
            let passes: Vec<&str> = audit.passes.iter().map(|pass| pass.name).collect();
            let mib = audit.bytes() as f64 / f64::from(1 << 20);
            let superfluous = audit.superfluous();
            let superfluous = if superfluous.is_empty() { "–".to_owned() } else { superfluous.join("; ") };
            println!(
                "| {} | {preset} | {} | {}, {} | {mib:.1} | {superfluous} |",
                scene.name,
                passes.join(", "),
                audit.pipelines,
                audit.used.len()
            );
        }
    }
    Ok(())
}
