//! What each change of a renderer costs: the change itself, and the next frame. `docs/costs.md` has its table.
//!
//! `cargo run --release --example changes [SCENE.glb]`

use std::path::PathBuf;
use std::time::Instant;

use twobounce::Result;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LoadOptions, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

/// Each change is made this often; the table has medians.
const TIMES: usize = 5;
const SIZE: (u32, u32) = (256, 256);

fn main() -> Result<()> {
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("assets/gallery.glb"), PathBuf::from);
    let scene = Scene::load(&path, &LoadOptions::default())?;
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
    let context = Context::new(&ContextOptions::default())?;
    let mut start = Settings::fast();
    start.set("voxels=64")?;
    let started = Instant::now();
    let options = RenderOptions::new(SIZE, bounds);
    let mut renderer = Renderer::new(&context, scene.clone(), &pose, start.clone(), options)?;
    let made = ms(started);
    for _ in 0..2 {
        renderer.render(&pose, &view)?;
    }
    println!(
        "{}, {}x{}, fast, 64 voxels, {}; milliseconds, medians of {TIMES}",
        scene.name, SIZE.0, SIZE.1, context.driver
    );
    println!(
        "| what changes | the change | the next frame |\n|---|---|---|\n| everything: a new renderer | {made:.0} | |"
    );

    let mut moved = view;
    moved.eye += moved.up * 0.01;
    row(
        "the camera, exposure",
        &mut renderer,
        |_, _| Ok(()),
        |i| (pose.clone(), if i.is_multiple_of(2) { moved } else { view }),
    )?;
    let mut lit = pose.clone();
    lit.lights.iter_mut().for_each(|light| light.position.y += 0.01);
    row(
        "a light moves",
        &mut renderer,
        |_, _| Ok(()),
        |i| (if i.is_multiple_of(2) { lit.clone() } else { pose.clone() }, view),
    )?;
    let mut elsewhere = pose.clone();
    elsewhere.world_from_instance[0].translation.y += 1e-4;
    let turns = |i: usize| (if i.is_multiple_of(2) { elsewhere.clone() } else { pose.clone() }, view);
    row("an instance moves", &mut renderer, |_, _| Ok(()), turns)?;
    let still = |_: usize| (pose.clone(), view);
    let edit = |what: fn(&mut Scene, f32), moved: &'static [usize]| {
        let (scene, pose) = (scene.clone(), pose.clone());
        move |renderer: &mut Renderer, i: usize| {
            let mut scene = scene.clone();
            what(&mut scene, 1.0 + 0.01 * i as f32);
            renderer.change_scene(scene, &pose, moved)
        }
    };
    row("the sky", &mut renderer, edit(|s, k| s.sky += 0.01 * k, &[]), still)?;
    row("a material", &mut renderer, edit(|s, k| s.materials[1].base_color.x /= k, &[]), still)?;
    row("a mesh's vertices", &mut renderer, edit(|s, k| s.meshes[0].positions[0].y += 0.001 * k, &[0]), still)?;
    let set = |key: &'static str, values: [&'static str; 2], size: [(u32, u32); 2]| {
        let start = start.clone();
        move |renderer: &mut Renderer, i: usize| {
            let mut settings = start.clone();
            settings.set(&format!("{key}={}", values[i % 2]))?;
            renderer.change(settings, size[i % 2])
        }
    };
    row("the image's size", &mut renderer, set("voxels", ["64", "64"], [(200, 200), SIZE]), still)?;
    row("`image.samples`", &mut renderer, set("image.samples", ["4", "1"], [SIZE; 2]), still)?;
    row("`rays.diffuse`", &mut renderer, set("rays.diffuse", ["5", "6"], [SIZE; 2]), still)?;
    row("`bounces`", &mut renderer, set("bounces", ["1", "2"], [SIZE; 2]), still)?;
    row("`voxels`", &mut renderer, set("voxels", ["32", "64"], [SIZE; 2]), still)?;
    row("`method`", &mut renderer, set("method", ["none", "rays"], [SIZE; 2]), still)
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Changes twice to warm up, then measures.
fn row(
    name: &str,
    renderer: &mut Renderer,
    change: impl Fn(&mut Renderer, usize) -> Result<()>,
    seen: impl Fn(usize) -> (twobounce::scene::Pose, View),
) -> Result<()> {
    let mut times = [Vec::new(), Vec::new()];
    for i in 0..TIMES + 2 {
        let started = Instant::now();
        change(renderer, i)?;
        let changed = ms(started);
        let (pose, view) = seen(i);
        let started = Instant::now();
        renderer.render(&pose, &view)?;
        if i >= 2 {
            times[0].push(changed);
            times[1].push(ms(started));
        }
    }
    let [change, frame] = times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[TIMES / 2]
    });
    println!("| {name} | {change:.1} | {frame:.0} |");
    Ok(())
}
