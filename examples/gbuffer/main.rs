//! An engine that draws its own G-buffer, which twobounce lights. A pipeline of this program draws depth, normal, base
//! colour, roughness and metallic; twobounce adds direct and indirect light, mirrors included, by the method of the
//! settings.
//!
//! `cargo run --release --example gbuffer -- SCENE.glb IMAGE.png [WxH [KEY=VALUE…]]`
//!
//! The scene's animation plays for some frames: moving objects are drawn, lit and mirrored at their place. The last
//! frame becomes a PNG. With `HOST_VALIDATION=1` any message of the validation layer ends the program with exit code 1.

#[path = "../host/gpu.rs"]
mod gpu;
#[path = "../host/program.rs"]
mod program;
mod raster;

use std::process::ExitCode;

use twobounce::glam::{DVec3, Vec3, Vec4};
use twobounce::host::{Aov, Context, Prepare, Prepared, Shot};
use twobounce::scene::{Pose, Projection, Scene, View};
use twobounce::settings::Settings;

use gpu::{Anything, Frame, Gpu};
use raster::{INPUTS, Raster, SHOWN, Surface};

const FRAMES: u32 = 4;
/// Passes over the last frame, each with other rays: the picture is their mean.
const PASSES: u32 = 16;
const SECONDS_A_FRAME: f32 = 0.25;

fn main() -> ExitCode {
    // SAFETY: the device is idle before anything is destroyed.
    program::run("gbuffer", |gpu, scene, settings, size| unsafe { play(gpu, scene, settings, size) })
}

/// Draws and lights all frames, one in flight, and reads back the last one: the mean of its passes.
unsafe fn play(gpu: &Gpu, scene: &Scene, settings: &Settings, size: (u32, u32)) -> Anything<Vec<[f32; 3]>> {
    unsafe {
        let context = Context::adopt(gpu.lent())?;
        let first = scene.pose(None, 0.0);
        let animation = (!scene.animations.is_empty()).then_some(0);
        let prepare = Prepare { slots: 1, given: true, ..Prepare::new(size, scene.bounds(animation)) };
        let mut prepared = Prepared::new(&context, scene, &first, settings, &prepare)?;
        let mut raster = Raster::new(gpu, size, scene.meshes.iter().map(|mesh| mesh.indices.len()).sum())?;
        // Once: state which of this program's images hold surfaces, and which receive light.
        let [depth, normal, albedo, material] = INPUTS.map(|input| raster.input(input));
        let inputs = prepared.inputs(depth, normal, albedo, Some(material))?;
        let outputs = [
            prepared.given_output(Aov::Direct, raster.output(SHOWN[1]))?,
            prepared.given_output(Aov::Indirect, raster.output(SHOWN[2]))?,
        ];
        let frame = Frame::new(gpu)?;
        let (mut number, mut before) = (0, None);
        let mut mean = vec![[0.0; 3]; (size.0 * size.1) as usize];
        while number < FRAMES + PASSES - 1 {
            let pass = (number + 1).saturating_sub(FRAMES);
            let pose = scene.pose(animation, (number - pass) as f32 * SECONDS_A_FRAME);
            let view = if scene.cameras.is_empty() { View::framing(prepare.bounds) } else { scene.view(&pose, 0) };
            raster.upload(&surfaces(scene, &pose, view.eye));
            frame.begin(gpu)?;
            raster.record(gpu, frame.commands, &matrix(&view, size)?);
            let seen = Shot { image: Some(pass), ..Shot::new(scene, &pose, &view) };
            prepared.record_given(frame.commands, 0, &seen, &inputs, &outputs);
            raster.record_read(gpu, frame.commands);
            frame.submit(gpu, before.replace(frame.done))?;
            frame.wait(gpu)?;
            if let Some(growth) = prepared.poll(0) {
                prepared.grow(growth)?; // and the frame, whose lists were too small, is made again
                continue;
            }
            number += 1;
            if number >= FRAMES {
                let of_pass = raster.pixels();
                let add = |(sum, one): (&mut f32, &f32)| *sum += one / PASSES as f32;
                mean.as_flattened_mut().iter_mut().zip(of_pass.as_flattened()).for_each(add);
            }
        }
        drop((prepared, context)); // made with this program's device
        frame.destroy(gpu);
        raster.destroy(gpu);
        Ok(mean)
    }
}

/// Three vertices for each triangle, relative to the eye: this engine has no textures.
fn surfaces(scene: &Scene, pose: &Pose, eye: DVec3) -> Vec<Surface> {
    let mut surfaces = Vec::new();
    for (instance, place) in scene.instances.iter().zip(&pose.world_from_instance) {
        let (mesh, normals) = (&scene.meshes[instance.mesh], place.matrix3.inverse().transpose().as_mat3());
        let material = &scene.materials[mesh.material];
        let [r, g, b, _] = material.base_color.to_array();
        surfaces.extend(mesh.indices.iter().map(|&index| {
            let position = place.transform_point3(mesh.positions[index as usize].as_dvec3()) - eye;
            let normal: Vec3 = (normals * mesh.normals[index as usize]).normalize_or_zero();
            Surface {
                position: position.as_vec3().into(),
                normal: normal.into(),
                albedo: [r, g, b],
                material: [material.roughness, material.metallic, material.specular],
                emitted: material.emissive.into(),
            }
        }));
    }
    surfaces
}

/// Rows of the matrix from positions relative to the eye to x · depth, y · depth (down) and the depth along the view.
fn matrix(view: &View, (width, height): (u32, u32)) -> Anything<[Vec4; 3]> {
    let Projection::Perspective { fov, .. } = view.projection else {
        return Err("this engine draws perspective cameras alone".into());
    };
    let scale = 1.0 / (0.5 * fov).tan();
    let (right, up, forward) = (view.right().as_vec3(), view.up.as_vec3(), view.forward.as_vec3());
    let across = scale * height as f32 / width as f32;
    Ok([right * across, up * -scale, forward].map(|row| row.extend(0.0)))
}
