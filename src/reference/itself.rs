//! Whether what a scene emits is enough to see it by.

use std::sync::atomic::AtomicBool;

use glam::{Vec3, Vec4};

use super::film::Film;
use super::{Control, Depth, Options, Stop, render};
use crate::Result;
use crate::layers::{Aov, Layers};
use crate::output::png::luminance;
use crate::scene::{Pose, Scene, Still, View};

/// An image of so few pixels and samples tells a lamp from a label that glows.
const SIZE: (u32, u32) = (48, 27);
const SAMPLES: u32 = 4;
/// Of the brightest emission: what a white wall one lamp's width away from a lamp reflects is a few tenths, the walls of a room
/// with one small lamp some thousandths. Below this, nine stops, either the lamp is white or all else black.
const LEAST: f32 = 1.0 / 512.0;
/// Of the pixels that show a surface: what automatic exposure makes bright.
const PERCENTILE: f64 = 0.95;

/// Whether the scene's own emission lights what `view` sees of it, so that one exposure can show both.
///
/// # Errors
/// As for [`render`].
pub fn lights_itself(scene: &Scene, pose: &Pose, view: &View) -> Result<bool> {
    let brightest = scene.instances.iter().map(|i| scene.materials[scene.meshes[i.mesh].material].emissive);
    let brightest = brightest.map(|emissive| luminance(emissive.into())).fold(0.0, f32::max);
    // What is seen of a black scene is emission alone.
    let mut black = scene.clone();
    for material in &mut black.materials {
        material.base_color = Vec4::new(0.0, 0.0, 0.0, material.base_color.w);
        (material.metallic, material.specular, material.transmission) = (0.0, 0.0, 0.0);
        material.specular_color = Vec3::ZERO;
    }
    let [lit, emitted] = [image(scene, pose, view)?, image(&black, pose, view)?];
    let surfaces = lit.get(Aov::Normal).unwrap_or_default().iter().map(|normal| *normal != [0.0; 3]);
    let reflected =
        lit.beauty().iter().zip(emitted.beauty()).map(|(lit, emitted)| luminance(*lit) - luminance(*emitted));
    let mut reflected: Vec<f32> = reflected.zip(surfaces).filter(|(_, surface)| *surface).map(|(l, _)| l).collect();
    if reflected.is_empty() {
        return Ok(true); // nothing to light
    }
    let rank = ((reflected.len() - 1) as f64 * PERCENTILE).round() as usize;
    let (_, bright, _) = reflected.select_nth_unstable_by(rank, f32::total_cmp);
    Ok(*bright >= LEAST * brightest)
}

/// Radiance and normals.
fn image(scene: &Scene, pose: &Pose, view: &View) -> Result<Layers> {
    let (width, height) = SIZE;
    let (depth, stop) = (Depth::Bounces(1), Stop::Samples(SAMPLES));
    let options = Options { width, height, depth, stop, seed: 0, occlusion: false };
    let (mut film, never) = (Film::new(width, height), AtomicBool::new(false));
    let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
    render(Still::new(scene, pose, view), &options, &mut film, control)?;
    Ok(film.layers(&[Aov::Normal]))
}
