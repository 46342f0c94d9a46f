//! Decides whether a scene's own emission lights it well enough.

use std::sync::atomic::AtomicBool;

use glam::{Vec3, Vec4};

use super::film::Film;
use super::integrator::Integrator;
use super::{Control, Depth, Options, Stop, integrator, trace};
use crate::Result;
use crate::layers::{Aov, Layers};
use crate::output::display::{Display, MOST_BLACK, ToneMap, black_share, luminance, percentile_95};
use crate::scene::{Pose, Scene, Still, View};

/// The number of pixels and samples, which suffices to distinguish a lamp from a glowing label.
const OPTIONS: Options =
    Options { width: 48, height: 27, depth: Depth::Bounces(1), stop: Stop::Samples(4), seed: 0, occlusion: false };
/// A share of the brightest emission. A white wall at a distance of one lamp's width reflects a few tenths of it, and
/// the walls of a room with one small lamp some thousandths. Below this, nine stops, no exposure can show both the lamp
/// and its surroundings.
const LEAST: f32 = 1.0 / 512.0;

/// Whether the scene's own emission lights the surfaces that `view` sees, so that one exposure can show both.
pub fn lights_itself(scene: &Scene, pose: &Pose, view: &View) -> Result<bool> {
    let brightest = scene.instances.iter().map(|i| scene.materials[scene.meshes[i.mesh].material].emissive);
    let brightest = brightest.map(|emissive| luminance(emissive.into())).fold(0.0, f32::max);
    // Black surfaces show only emission.
    let mut black = scene.materials.clone();
    for material in &mut black {
        material.base_color = Vec4::new(0.0, 0.0, 0.0, material.base_color.w);
        (material.metallic, material.specular, material.transmission) = (0.0, 0.0, 0.0);
        material.specular_color = Vec3::ZERO;
    }
    let mut integrator = integrator(Still::new(scene, pose, view), &OPTIONS)?;
    let lit = image(&integrator, view)?;
    integrator.show(&black);
    let emitted = image(&integrator, view)?;
    let is_surface = |pixel: &usize| lit.get(Aov::Normal).is_some_and(|normals| normals[*pixel] != [0.0; 3]);
    let surfaces: Vec<usize> = (0..lit.beauty().len()).filter(is_surface).collect();
    if surfaces.is_empty() {
        return Ok(true); // nothing is lit
    }
    let seen: Vec<&[f32; 3]> = surfaces.iter().map(|&pixel| &lit.beauty()[pixel]).collect();
    // Neither the sky nor another light exists, so all other pixels are black and do not count.
    if black_share(&seen, Display::automatic(ToneMap::default(), lit.beauty())) > MOST_BLACK {
        return Ok(false);
    }
    let reflected = |&pixel: &usize| luminance(lit.beauty()[pixel]) - luminance(emitted.beauty()[pixel]);
    // Only pixels with a surface count: automatic exposure makes them bright.
    let bright = percentile_95(surfaces.iter().map(reflected).collect());
    Ok(bright >= LEAST * brightest)
}

/// Renders radiance and normals.
fn image(integrator: &Integrator, view: &View) -> Result<Layers> {
    let (mut film, never) = (Film::new(OPTIONS.width, OPTIONS.height), AtomicBool::new(false));
    let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
    trace(integrator, view, &OPTIONS, &mut film, control)?;
    Ok(film.layers(&[Aov::Normal]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh};
    use glam::{DAffine3, DVec3};

    /// A wall 2 m wide, seen from 2 m in front of it, and a lamp of 12 cm at `corner` with its edges `u` and `v`.
    fn wall_with_lamp(corner: Vec3, u: Vec3, v: Vec3) -> bool {
        let mut scene = Scene::empty("wall");
        let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
        let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(100.0)));
        let wall = Mesh::quad("wall", grey, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
        scene.add_mesh(wall, DAffine3::IDENTITY);
        scene.add_mesh(Mesh::quad("lamp", lamp, corner, 0.12 * u, 0.12 * v), DAffine3::IDENTITY);
        let view = View::look_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, DVec3::Y, 1.0);
        lights_itself(&scene, &scene.pose(None, 0.0), &view).expect("an image")
    }

    #[test]
    fn a_lamp_lights_a_scene_if_little_of_it_stays_black() {
        assert!(wall_with_lamp(Vec3::new(0.0, 0.0, 0.5), Vec3::Y, Vec3::X), "a lamp before the wall, which faces it");
        assert!(!wall_with_lamp(Vec3::new(0.0, 0.0, 0.5), Vec3::X, Vec3::Y), "a lamp that faces the camera");
        // The lamp's light reaches a fifth of the wall, more than the 95th percentile needs.
        assert!(
            !wall_with_lamp(Vec3::new(-0.6, 0.0, 0.01), Vec3::Z, Vec3::Y),
            "a lamp across the wall, which faces left"
        );
    }
}
