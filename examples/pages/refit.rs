//! Rays through a tree that was only refitted after skins and morph targets moved its triangles: their steps from box
//! to box, and those through a tree that was built for the pose.

use std::path::PathBuf;
use std::sync::Arc;

use twobounce::Result;
use twobounce::assets;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::markdown;
use twobounce::profile::counts::Counts;
use twobounce::renderer::RenderOptions;
use twobounce::scene::{LoadOptions, Playback, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

const SIZE: (u32, u32) = (96, 96);
/// Moments of an animation, evenly spaced; the first shows the file's own pose.
const MOMENTS: u32 = 6;

pub fn run(paths: &[PathBuf]) -> Result<()> {
    let context = Context::counting(&ContextOptions::default())?;
    let load = |path: &PathBuf| Scene::load(path, &LoadOptions::default());
    let mut scenes = paths.iter().map(load).collect::<Result<Vec<_>>>()?;
    if scenes.is_empty() {
        scenes.push(Scene::load_glb("demo", assets::demo()?, &LoadOptions::default())?);
    }
    let rows = scenes.iter().map(|scene| rows(&context, scene)).collect::<Result<Vec<_>>>()?.concat();
    print!("{}", markdown(["scene", "second", "refitted", "made for the pose", "ratio"], "-", rows));
    Ok(())
}

fn rows(context: &Arc<Context>, scene: &Scene) -> Result<Vec<[String; 5]>> {
    let seconds = scene.animations.first().map_or(0.0, |animation| f64::from(animation.duration));
    let bounds = scene.bounds(Some(0)); // for both, and so the same grid and view
    let playback = Playback { animations: vec![0], repeats: false };
    // Steps of all rays of a frame of `fast`, at 32³.
    let settings = Settings { voxels: 32, ..Settings::fast() };
    let steps = |specimen: &Specimen| {
        let mut renderer = specimen.renderer(context, &settings, RenderOptions::new(SIZE, bounds))?;
        let report = renderer.render(&specimen.pose, &specimen.view)?;
        Ok::<_, twobounce::Error>(
            report.timings.zones.iter().map(|zone| Counts::of_counters(&zone.counts).ray_steps).sum::<u64>(),
        )
    };
    let row = |moment: u32| {
        let time = seconds * f64::from(moment) / f64::from(MOMENTS);
        let pose = scene.pose_of(&playback, time);
        let mut baked = scene.clone();
        baked.meshes = scene.posed_meshes(&pose).into_iter().map(|mesh| mesh.into_owned()).collect();
        baked.meshes.iter_mut().for_each(|mesh| mesh.deform = None);
        let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
        let refitted = steps(&Specimen { scene: scene.clone(), pose: pose.clone(), view })?;
        let made = steps(&Specimen { scene: baked, pose, view })?;
        let ratio = format!("{:.2}", refitted as f64 / made as f64);
        Ok([scene.name.clone(), format!("{time:.1}"), refitted.to_string(), made.to_string(), ratio])
    };
    (0..=MOMENTS).map(row).collect()
}
