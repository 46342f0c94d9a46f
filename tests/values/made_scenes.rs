//! Invalid scenes, poses and settings that a program made are refused with a message before anything reads them.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3, Vec4};
use twobounce::scene::deform::{Deform, Deformer};
use twobounce::scene::{
    Animation, Camera, Channel, Instance, Interpolation, LightKind, Material, Mesh, Projection, Property, Scene,
    Texture, TextureImage, TextureRef, WeightChannel,
};
use twobounce::settings::{PRESETS, Settings};

/// A floor, a light, and a mesh with a skin of one joint.
fn scene() -> Scene {
    let mut scene = Scene::empty("made");
    let white = scene.add_material(Material::lambert("white", Vec3::ONE));
    let floor = Mesh::quad("floor", white, Vec3::ZERO, Vec3::Z, Vec3::X);
    scene.add_mesh(floor.clone(), DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::ONE, DAffine3::from_translation(DVec3::Y));
    let joint = twobounce::scene::deform::Joint { node: 0, joint_from_mesh: DAffine3::IDENTITY };
    scene.deformers.push(Deformer { node: 0, joints: vec![joint], weights: vec![] });
    let vertices = floor.positions.len();
    let deform = Deform {
        positions: floor.positions.clone(),
        normals: floor.normals.clone(),
        tangents: floor.tangents.clone(),
        influences: 1,
        skin: vec![(0, 1.0); vertices],
        ..Default::default()
    };
    scene.add_mesh(Mesh { deform: Some(Arc::new(deform)), ..floor }, DAffine3::IDENTITY);
    scene
}

fn camera(node: usize) -> Camera {
    let projection = Projection::Perspective { fov: 1.0, near: 0.1, far: f32::INFINITY };
    Camera { name: "camera".into(), node, projection }
}

/// A channel of one key that moves a node, with this many values.
fn animation(node: usize, values: usize) -> Animation {
    let values = vec![Vec4::ZERO; values];
    let (property, interpolation) = (Property::Translation, Interpolation::Linear);
    let channel = Channel { node, times: vec![0.0], property, values, interpolation };
    Animation { channels: vec![channel], ..Animation::default() }
}

/// Weights of this many targets of a deformer at one time.
fn weights(deformer: usize, width: usize) -> Animation {
    let (times, interpolation) = (vec![0.0], Interpolation::Linear);
    let channel = WeightChannel { deformer, times, values: vec![0.0; width], width, interpolation };
    Animation { weights: vec![channel], ..Animation::default() }
}

#[test]
fn scenes_that_make_no_sense_are_refused_in_a_sentence() {
    scene().check().expect("the scene itself is right");
    let deform = |scene: &mut Scene, change: fn(&mut Deform)| {
        change(Arc::make_mut(scene.meshes[1].deform.as_mut().unwrap()));
    };
    let texture = Some(TextureRef { texture: 3, uv_set: 0, transform: glam::Affine2::IDENTITY });
    type Change<'a> = &'a dyn Fn(&mut Scene);
    let changes: [(Change, &str); 21] = [
        (&|s| s.meshes[0].positions[1].y = f32::NAN, "mesh 0 has a position that is not finite"),
        (&|s| s.meshes[0].indices[2] = 4, "the indices of mesh 0 are not three a triangle, each below its 4 vertices"),
        (&|s| s.meshes[0].indices.truncate(4), "the indices of mesh 0 are not three a triangle"),
        (&|s| s.meshes[0].normals.truncate(3), "mesh 0 has 4 positions, but not as many normals"),
        (&|s| s.meshes[0].material = 9, "mesh 0 refers to material 9, but the scene has 2"),
        (&|s| s.materials[1].base_color_texture = texture, "material 1 refers to texture 3, but the scene has 0"),
        (&|s| s.instances.push(Instance { mesh: 7, node: 0 }), "instance 2 refers to mesh 7, but the scene has 2"),
        (&|s| s.lights[0].node = 99, "light 0 refers to node 99"),
        (&|s| s.nodes[0].parent = Some(0), "node 0 stands before its parent"),
        (&|s| deform(s, |d| d.skin[3].0 = 1), "mesh 1 refers to a joint that deformer 0 lacks: it has 1"),
        (&|s| deform(s, |d| d.skin.truncate(3)), "the skin or the morph targets of mesh 1"),
        (&|s| deform(s, |d| d.positions[2].x = f32::INFINITY), "mesh 1 has a position that is not finite"),
        (&|s| deform(s, |d| d.deformer = 5), "mesh 1 refers to deformer 5, but the scene has 1"),
        (&|s| s.deformers[0].joints[0].node = 50, "deformer 0 refers to node 50"),
        (&|s| s.deformers[0].node = 51, "deformer 0 refers to node 51"),
        (
            &|s| s.images.push(TextureImage { width: 2, height: 2, ..TextureImage::default() }),
            "image 0 is 2x2, but has 0 bytes",
        ),
        (&|s| s.cameras.push(camera(60)), "camera 0 refers to node 60"),
        (&|s| s.animations.push(animation(70, 1)), "animation 0 refers to node 70"),
        (&|s| s.animations.push(animation(0, 2)), "a channel of animation 0 has 1 times, but not a value for each"),
        (&|s| s.animations.push(weights(3, 0)), "animation 0 refers to deformer 3"),
        (
            &|s| s.animations.push(weights(0, 1)),
            "the weights of animation 0 have 1 times, but not a value for each of 0",
        ),
    ];
    for (change, sentence) in changes {
        let mut scene = scene();
        change(&mut scene);
        let said = scene.check().expect_err(sentence).to_string();
        assert!(said.starts_with(sentence), "{said}");
    }
    let mut scene = scene();
    let wrap = [twobounce::scene::Wrap::Repeat; 2];
    let mip = twobounce::scene::Mip::Linear;
    scene.textures.push(Texture { image: 0, wrap, mag_linear: true, min_linear: true, mip });
    assert_eq!(scene.check().unwrap_err().to_string(), "texture 0 refers to image 0, but the scene has 0");
}

#[test]
fn poses_of_other_scenes_are_refused_in_a_sentence() {
    let scene = scene();
    let pose = scene.pose(None, 0.0);
    pose.check(&scene).expect("its own pose");
    let mut few = pose.clone();
    few.deforms[0].joints.clear();
    assert_eq!(few.check(&scene).unwrap_err().to_string(), "a pose of deformer 0 must have 1 joints and 0 weights");
    let mut bent = pose.clone();
    bent.deforms[0].joints[0][1][2] = f32::NAN;
    assert!(bent.check(&scene).unwrap_err().to_string().starts_with("the transform of deformer 0 is not finite"));
    let mut lost = pose.clone();
    lost.world_from_instance.pop();
    assert!(lost.check(&scene).unwrap_err().to_string().starts_with("a pose is of another scene"));
    let mut far = pose;
    far.world_from_instance[0].translation.x = f64::INFINITY;
    let said = far.check(&scene).unwrap_err().to_string();
    assert!(said.starts_with("the transform of instance 0 is not finite in this pose"), "{said}");
}

#[test]
fn settings_that_are_out_of_range_are_refused_by_their_key() {
    for preset in PRESETS {
        (preset.settings)().check().unwrap_or_else(|error| panic!("{}: {error}", preset.name));
    }
    type Change = fn(&mut Settings);
    let changes: [(Change, &str); 4] = [
        (|s| s.image.samples = 77, "image.samples"),
        (|s| s.image.samples = 0, "image.samples"),
        (|s| s.voxels = 0, "voxels"),
        (|s| s.lights.lamp_points = u32::MAX, "lights.lamp_points"),
    ];
    for (change, key) in changes {
        let mut settings = Settings::default();
        change(&mut settings);
        let said = settings.check().expect_err(key).to_string();
        assert!(said.contains(key), "{said}");
    }
}
