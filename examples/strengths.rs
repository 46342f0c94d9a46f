//! Fills the tables of README.md, `docs/accuracy.md` and `docs/study/strengths.md`, a comparison of the methods in numbers.
//!
//! `cargo run --release --example strengths [PRESET,…]` measures leaks and noise of these presets again, by default of all that
//! the page shows, and keeps the other lines of its last table. With `none` it measures nothing. Errors, times and memory are taken
//! from the rows of the study.

pub mod tables;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use twobounce::lab::table::{fill_file, markdown};
use twobounce::layers::{Aov, Layers};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, LoadOptions, Material, Mesh, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

use tables::CHOSEN;

const VOXELS: u32 = 64;
const SIZE: u32 = 96;
/// Frames of a light that moves, and how far it moves in each.
const FRAMES: usize = 7;
const STEP_M: f64 = 0.02;

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rows = tables::rows(root)?;
    let chosen = std::env::args().nth(1);
    let chosen: Vec<&str> = chosen.as_deref().map_or_else(|| CHOSEN.to_vec(), |names| names.split(',').collect());
    let context = Context::new(&ContextOptions::default())?;
    for page in tables::PAGES {
        let table = |name: &str, old: &str| match name {
            "measured" => measured_again(&context, &chosen, old),
            _ => tables::table(name, &rows, old),
        };
        if fill_file(&root.join(page), table)? {
            println!("filled the tables of {page}");
        }
    }
    Ok(())
}

/// The last table with the lines of these presets measured again.
fn measured_again(context: &Arc<Context>, chosen: &[&str], old: &str) -> Result<String> {
    let head = ["preset", "leak, 1 voxel", "leak, ½ voxel", "noise", "moving light", "moving light, all"];
    let mut table = markdown(head, "-:", [[""; 0]; 0]);
    for preset in CHOSEN {
        let kept = old.lines().find(|line| line.starts_with(&format!("| `{preset}` |")));
        let line = match kept {
            Some(line) if !chosen.contains(preset) => line.to_owned(),
            _ => measured(context, preset)?,
        };
        println!("{line}");
        table += &(line + "\n");
    }
    Ok(table)
}

/// A preset's line of the last table.
fn measured(context: &Arc<Context>, preset: &str) -> Result<String> {
    let settings = |changes: &[&str]| {
        let mut settings = Settings::preset(preset)?;
        settings.set(&format!("voxels={VOXELS}"))?;
        changes.iter().try_for_each(|change| settings.set(change))?;
        Ok::<_, Error>(settings)
    };
    let plain = settings(&[])?;
    let [whole, half] = [leak(context, &plain, 1.0)?, leak(context, &plain, 0.5)?];
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/cornell-point.glb");
    let scene = Scene::load(&path, &LoadOptions::default())?;
    let (noise, moving) = steadiness(context, &scene, &plain)?;
    let (_, moving_all) = steadiness(context, &scene, &settings(&["bounces=all"])?)?;
    Ok(format!(
        "| `{preset}` | {:.3} % | {:.3} % | {:.2} % | {:.2} % | {:.2} % |",
        100.0 * whole,
        100.0 * half,
        100.0 * noise,
        100.0 * moving,
        100.0 * moving_all
    ))
}

/// Two rooms of 1 m that share a wall, `thick` voxels thick; a light is in one of them. The dark one's mean over the lit one's.
pub fn leak(context: &Arc<Context>, settings: &Settings, thick: f32) -> Result<f64> {
    let mut scene = Scene::empty("two rooms");
    let plaster = Material { double_sided: true, ..Material::lambert("plaster", Vec3::splat(0.7)) };
    let wall = scene.add_material(plaster);
    let shell = Mesh::cuboid("shell", wall, Vec3::new(-1.0, -0.5, -0.5), Vec3::new(1.0, 0.5, 0.5), true);
    scene.add_mesh(shell, DAffine3::IDENTITY);
    // The longest side fills the grid but for its margins. The wall stands where no voxel begins.
    let voxel = 2.0 / (settings.voxels as f32 - 2.0 * settings.grid.margin as f32);
    let (near, far) = (0.011 - 0.5 * thick * voxel, 0.011 + 0.5 * thick * voxel);
    let between = Mesh::cuboid("wall", wall, Vec3::new(near, -0.5, -0.5), Vec3::new(far, 0.5, 0.5), false);
    scene.add_mesh(between, DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::splat(1.0), DAffine3::from_translation(DVec3::new(-0.5, 0.2, 0.0)));
    let mean = |x: f64| {
        let look = View::look_at(DVec3::new(0.95 * x, 0.0, 0.0), DVec3::ZERO, DVec3::Y, 80f32.to_radians());
        let pose = scene.pose(None, 0.0);
        let options = RenderOptions::new((32, 32), scene.bounds(None));
        let mut renderer = Renderer::new(context, scene.clone(), &pose, settings.clone(), options)?;
        renderer.render(&pose, &look)?;
        let image = renderer.read();
        Ok::<f64, Error>(image.beauty().iter().map(|p| brightness(*p)).sum())
    };
    Ok(mean(1.0)? / mean(-1.0)?)
}

/// Noise of the indirect light from pixel to pixel, and from frame to frame while the lamp moves.
fn steadiness(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Result<(f64, f64)> {
    let mut pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    let aovs = vec![Aov::Indirect, Aov::Normal, Aov::Albedo, Aov::Depth];
    let options = RenderOptions { aovs, ..RenderOptions::new((SIZE, SIZE), scene.bounds(None)) };
    let mut renderer = Renderer::new(context, scene.clone(), &pose, settings.clone(), options)?;
    let mut frames = Vec::new();
    for _ in 0..FRAMES {
        renderer.render(&pose, &view)?;
        frames.push(renderer.read());
        pose.lights.iter_mut().for_each(|light| light.position.x += STEP_M);
    }
    Ok((spatial(&frames[0]), temporal(&frames)))
}

fn brightness(pixel: [f32; 3]) -> f64 {
    pixel.iter().map(|channel| f64::from(*channel)).sum()
}

fn layer(image: &Layers, aov: Aov) -> &[[f32; 3]] {
    &image.layers.iter().find(|(kind, _)| *kind == aov).expect("the layer was asked for").1
}

/// Root mean square of (a − 2b + c)/√6 over the mean of b: of white noise, its standard deviation.
fn second_differences(triples: impl Iterator<Item = [f64; 3]>) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for [a, b, c] in triples {
        squares += (a - 2.0 * b + c).powi(2) / 6.0;
        sum += b;
        count += 1.0;
    }
    (squares / f64::max(count, 1.0)).sqrt() / (sum / f64::max(count, 1.0))
}

/// Over pixels in a row that show one flat surface.
fn spatial(image: &Layers) -> f64 {
    let light = layer(image, Aov::Indirect);
    let (normal, albedo) = (layer(image, Aov::Normal), layer(image, Aov::Albedo));
    let width = image.width as usize;
    let same = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
    let alike = |i: usize, j: usize| same(normal[i], normal[j]) && same(albedo[i], albedo[j]);
    let rows = (0..light.len()).filter(|i| (1..width - 1).contains(&(i % width)));
    let flat = rows.filter(|&i| alike(i - 1, i) && alike(i, i + 1) && brightness(albedo[i]) > 0.0);
    second_differences(flat.map(|i| [i - 1, i, i + 1].map(|j| brightness(light[j]))))
}

fn temporal(frames: &[Layers]) -> f64 {
    let triples = frames.windows(3).flat_map(|three| {
        let lights: Vec<&[[f32; 3]]> = three.iter().map(|frame| layer(frame, Aov::Indirect)).collect();
        (0..lights[0].len()).map(move |i| [0, 1, 2].map(|k| brightness(lights[k][i])))
    });
    second_differences(triples)
}
