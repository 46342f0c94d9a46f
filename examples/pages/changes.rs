//! Times of each change of a renderer: the change itself, and the next frame.

use std::path::Path;
use std::time::Instant;

use twobounce::Result;
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::markdown;
use twobounce::measure::timing::Spread;
use twobounce::renderer::Renderer;
use twobounce::scene::{Pose, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};

/// Each change is made this many times; the table has medians.
const TIMES: usize = 5;
const SIZE: (u32, u32) = (256, 256);

pub fn run(path: &Path) -> Result<()> {
    let specimen = Specimen::load(path)?;
    let Specimen { scene, pose, view } = specimen.clone();
    let context = Context::new(&ContextOptions::default())?;
    let mut start = Settings::fast();
    start.set("voxels=64")?;
    let started = Instant::now();
    let mut renderer = specimen.renderer(&context, &start, specimen.options(SIZE))?;
    let made = format!("{:.0}", ms(started));
    for _ in 0..2 {
        renderer.render(&pose, &view)?;
    }
    println!(
        "{}, {}x{}, fast, 64 voxels, {}; milliseconds, medians of {TIMES}",
        scene.name, SIZE.0, SIZE.1, context.driver
    );
    let mut rows = vec![["everything: a new renderer".to_owned(), made, String::new()]];
    let mut row = |name: &str, change: &Change, seen: &dyn Fn(usize) -> (Pose, View)| -> Result<()> {
        rows.push(measured(name, &mut renderer, change, seen)?);
        Ok(())
    };

    let (mut moved, mut lit, mut elsewhere) = (view, pose.clone(), pose.clone());
    moved.eye += moved.up * 0.01;
    lit.lights.iter_mut().for_each(|light| light.position.y += 0.01);
    elsewhere.world_from_instance[0].translation.y += 1e-4;
    let nothing = |_: &mut Renderer, _: usize| Ok(());
    let by_turns = |other: Pose, other_view: View| {
        let pose = pose.clone();
        move |i: usize| if i.is_multiple_of(2) { (other.clone(), other_view) } else { (pose.clone(), view) }
    };
    row("the camera, exposure", &nothing, &by_turns(pose.clone(), moved))?;
    row("a light moves", &nothing, &by_turns(lit, view))?;
    row("an instance moves", &nothing, &by_turns(elsewhere, view))?;

    let still = |_: usize| (pose.clone(), view);
    let edit = |what: fn(&mut Scene, f32), moved: &'static [usize]| {
        let (scene, pose) = (scene.clone(), pose.clone());
        move |renderer: &mut Renderer, i: usize| {
            let mut scene = scene.clone();
            what(&mut scene, 1.0 + 0.01 * i as f32);
            renderer.change_scene(scene, &pose, moved)
        }
    };
    row("the sky", &edit(|s, k| s.sky += 0.01 * k, &[]), &still)?;
    row("a material", &edit(|s, k| s.materials[1].base_color.x /= k, &[]), &still)?;
    row("a mesh's vertices", &edit(|s, k| s.meshes[0].positions[0].y += 0.001 * k, &[0]), &still)?;

    let set = |key: &'static str, values: [&'static str; 2], first_size: (u32, u32)| {
        let start = start.clone();
        move |renderer: &mut Renderer, i: usize| {
            let mut settings = start.clone();
            settings.set(&format!("{key}={}", values[i % 2]))?;
            renderer.change(settings, [first_size, SIZE][i % 2])
        }
    };
    row("the image's size", &set("voxels", ["64", "64"], (200, 200)), &still)?;
    row("`image.samples`", &set("image.samples", ["4", "1"], SIZE), &still)?;
    row("`rays.diffuse`", &set("rays.diffuse", ["5", "6"], SIZE), &still)?;
    row("`bounces`", &set("bounces", ["1", "2"], SIZE), &still)?;
    row("`voxels`", &set("voxels", ["32", "64"], SIZE), &still)?;
    row("`method`", &set("method", ["none", "rays"], SIZE), &still)?;
    print!("{}", markdown(["what changes", "the change", "the next frame"], "-", rows));
    Ok(())
}

type Change<'a> = dyn Fn(&mut Renderer, usize) -> Result<()> + 'a;

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Changes twice to warm up, then measures.
fn measured(
    name: &str,
    renderer: &mut Renderer,
    change: &Change,
    seen: &dyn Fn(usize) -> (Pose, View),
) -> Result<[String; 3]> {
    let mut times = [Vec::new(), Vec::new()];
    for i in 0..TIMES + 2 {
        let started = Instant::now();
        change(renderer, i)?;
        times[0].push(ms(started));
        let (pose, view) = seen(i);
        let started = Instant::now();
        renderer.render(&pose, &view)?;
        times[1].push(ms(started));
    }
    let [change, frame] = times.map(|times| Spread::of_values(times[2..].iter().copied()).median);
    Ok([name.to_owned(), format!("{change:.1}"), format!("{frame:.0}")])
}
