//! What a tree that is only refitted costs rays, once skins and morph targets have moved its triangles: steps from box to box, beside
//! those through a tree that is made for the pose. `docs/costs.md` has its table.
//!
//! `cargo run --release --example refit [SCENE.glb …]`

use std::path::PathBuf;
use std::sync::Arc;

use twobounce::Result;
use twobounce::assets;
use twobounce::profile::counts::Counts;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{Bounds, LoadOptions, Playback, Pose, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

const SIZE: (u32, u32) = (96, 96);
/// Moments of an animation, evenly apart; at the first the file's own pose is shown.
const MOMENTS: u32 = 6;

fn main() -> Result<()> {
    let context = Context::counting(&ContextOptions::default())?;
    println!("| scene | second | refitted | made for the pose | ratio |\n|---|---|---|---|---|");
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    for path in &paths {
        table(&context, &Scene::load(path, &LoadOptions::default())?)?;
    }
    if paths.is_empty() {
        table(&context, &Scene::load_glb("demo", assets::demo()?, &LoadOptions::default())?)?;
    }
    Ok(())
}

fn table(context: &Arc<Context>, scene: &Scene) -> Result<()> {
    let seconds = scene.animations.first().map_or(0.0, |animation| f64::from(animation.duration));
    let bounds = scene.bounds(Some(0)); // for both, and so the same grid and view
    let playback = Playback { animations: vec![0], repeats: false };
    for moment in 0..=MOMENTS {
        let time = seconds * f64::from(moment) / f64::from(MOMENTS);
        let pose = scene.pose_of(&playback, time);
        let mut baked = scene.clone();
        baked.meshes = scene.posed_meshes(&pose).into_iter().map(|mesh| mesh.into_owned()).collect();
        baked.meshes.iter_mut().for_each(|mesh| mesh.deform = None);
        let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
        let [refitted, made] = [scene, &baked].map(|scene| steps((context, bounds), scene, &pose, &view));
        let (refitted, made) = (refitted?, made?);
        println!("| {} | {time:.1} | {refitted} | {made} | {:.2} |", scene.name, refitted as f64 / made as f64);
    }
    Ok(())
}

/// Steps of all rays of a frame of `fast`, at 32³.
fn steps((context, bounds): (&Arc<Context>, Bounds), scene: &Scene, pose: &Pose, view: &View) -> Result<u64> {
    let mut settings = Settings::fast();
    settings.set("voxels=32")?;
    let mut renderer = Renderer::new(context, scene.clone(), pose, settings, RenderOptions::new(SIZE, bounds))?;
    let report = renderer.render(pose, view)?;
    Ok(report.timings.zones.iter().map(|zone| Counts::of(&zone.counts).ray_steps).sum())
}
