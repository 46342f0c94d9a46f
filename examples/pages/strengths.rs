//! Fills the tables of README.md, `docs/accuracy.md` and `docs/notes/strengths.md`, a comparison of the methods in
//! numbers. Errors, times and memory come from the rows of the study; leaks and noise are measured.

use std::path::Path;
use std::sync::Arc;

use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::{fill_file, markdown};
use twobounce::layers::{Aov, Layers};
use twobounce::renderer::RenderOptions;
use twobounce::settings::Settings;
use twobounce::stability::scenes::{DARK, LIT, divided, view};
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

use crate::tables::{self, CHOSEN};

const VOXELS: u32 = 64;
const SIZE: u32 = 96;
/// Frames of a moving light, and its motion in each.
const FRAMES: usize = 7;
const STEP_M: f64 = 0.02;

/// Measures leaks and noise of the chosen presets again, and keeps the other lines of the last table.
pub fn run(chosen: &[String]) -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rows = tables::rows(root)?;
    let context = Context::new(&ContextOptions::default())?;
    for page in tables::PAGES {
        let table = |name: &str, old: &str| match name {
            "measured" => measured_again(&context, chosen, old),
            _ => tables::table(name, &rows, old),
        };
        if fill_file(&root.join(page), table)? {
            println!("filled the tables of {page}");
        }
    }
    Ok(())
}

/// The last table with the lines of these presets measured again.
fn measured_again(context: &Arc<Context>, chosen: &[String], old: &str) -> Result<String> {
    let head = ["preset", "leak, 1 voxel", "leak, ½ voxel", "noise", "moving light", "moving light, all"];
    let mut table = markdown(head, "-:", [[""; 0]; 0]);
    for preset in CHOSEN {
        let kept = old.lines().find(|line| line.starts_with(&format!("| `{preset}` |")));
        let line = match kept {
            Some(line) if !chosen.iter().any(|name| name == preset) => line.to_owned(),
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
    let leaks = [leak(context, &plain, 1.0)?, leak(context, &plain, 0.5)?].map(|leak| format!("{:.3} %", 100.0 * leak));
    let cornell = Specimen::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/cornell-point.glb"))?;
    let (noise, moving) = steadiness(context, &cornell, &plain)?;
    let (_, moving_all) = steadiness(context, &cornell, &settings(&["bounces=all"])?)?;
    let noises = [noise, moving, moving_all].map(|noise| format!("{:.2} %", 100.0 * noise));
    Ok(format!("| `{preset}` | {} | {} |", leaks.join(" | "), noises.join(" | ")))
}

/// Two rooms of 1 m that share a wall, `thick` voxels thick, with a light in one of them. The result is the dark room's
/// mean over the lit one's.
pub fn leak(context: &Arc<Context>, settings: &Settings, thick: f64) -> Result<f64> {
    // The longest side fills the grid except its margins.
    let voxel_m = 2.0 / (f64::from(settings.voxels) - 2.0 * settings.grid.margin);
    let rooms = Specimen::new(divided(thick * voxel_m).scene);
    let light = |eye| {
        let specimen = Specimen { view: view(eye, [0.0; 3]), ..rooms.clone() };
        let image = specimen.rendered(context, settings, specimen.options((32, 32)))?;
        Ok::<f64, Error>(image.beauty().iter().map(|p| brightness(*p)).sum())
    };
    Ok(light(DARK)? / light(LIT)?)
}

/// Noise of the indirect light from pixel to pixel, and from frame to frame while the lamp moves.
fn steadiness(context: &Arc<Context>, specimen: &Specimen, settings: &Settings) -> Result<(f64, f64)> {
    let mut pose = specimen.pose.clone();
    let aovs = vec![Aov::Indirect, Aov::Normal, Aov::Albedo, Aov::Depth];
    let options = RenderOptions { aovs, ..specimen.options((SIZE, SIZE)) };
    let mut renderer = specimen.renderer(context, settings, options)?;
    let mut frames = Vec::new();
    for _ in 0..FRAMES {
        renderer.render(&pose, &specimen.view)?;
        frames.push(renderer.read());
        pose.lights.iter_mut().for_each(|light| light.position.x += STEP_M);
    }
    Ok((spatial(&frames[0]), temporal(&frames)))
}

fn brightness(pixel: [f32; 3]) -> f64 {
    pixel.iter().map(|channel| f64::from(*channel)).sum()
}

fn layer(image: &Layers, aov: Aov) -> &[[f32; 3]] {
    image.get(aov).expect("the layer was asked for")
}

/// Root mean square of (a − 2b + c)/√6 over the mean of b: for white noise this is its standard deviation.
fn second_differences(triples: impl Iterator<Item = [f64; 3]>) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for [a, b, c] in triples {
        squares += (a - 2.0 * b + c).powi(2) / 6.0;
        sum += b;
        count += 1.0;
    }
    (squares / f64::max(count, 1.0)).sqrt() / (sum / f64::max(count, 1.0))
}

/// Over pixels of a row that show one flat surface.
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
