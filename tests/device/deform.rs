//! Skins and morph targets: closed forms, the device's pass against its twin on the CPU, the renderer against the path
//! tracer in several poses, and no trace of an earlier pose.

use crate::gpu;

use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DQuat, DVec3, Vec3, Vec4};
use twobounce::frame::MOST_SETTLING;
use twobounce::layers::Layers;
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::renderer::{RenderOptions, Renderer, SETTLED};
use twobounce::scene::deform::{Deform, Deformer, Joint, TargetDeltas};
use twobounce::scene::{
    Animation, Channel, Instance, Interpolation, LightKind, LoadOptions, Material, Mesh, Node, Playback, Pose,
    Property, Scene, Still, Transform, View, WeightChannel,
};
use twobounce::settings::Settings;
use twobounce::vk::download;

/// The time in seconds in which the bar bends.
const BENT: f32 = 1.0;

fn node(scene: &mut Scene, parent: Option<usize>, translation: DVec3) -> usize {
    let local = Transform::Trs { translation, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
    scene.nodes.push(Node { name: String::new(), parent, local });
    scene.nodes.len() - 1
}

/// A bar of `material` from 0 to 2 along +Y, half a metre thick, and two joints at the heights 0 and 1. Above 1 only
/// the upper joint moves it, below 1 only the lower one, and at 1 both equally. Within a second the upper joint turns
/// by 90° about +Z; meanwhile a target, whose weight goes from 0 to 1, widens the bar along Z by half.
fn add_bar(scene: &mut Scene, material: usize, at: DVec3) -> usize {
    let mut mesh = Mesh::default();
    for k in 0..8 {
        let low = Vec3::new(-0.25, 0.25 * k as f32, -0.25);
        let part = Mesh::cuboid("bar", material, low, low + Vec3::new(0.5, 0.25, 0.5), false);
        let first = mesh.positions.len() as u32;
        mesh.indices.extend(part.indices.iter().map(|i| first + i));
        mesh.positions.extend(&part.positions);
        mesh.normals.extend(&part.normals);
        mesh.tangents.extend(&part.tangents);
        mesh.colors.extend(&part.colors);
        (0..2).for_each(|set| mesh.uvs[set].extend(&part.uvs[set]));
    }
    let lower = node(scene, None, at);
    let upper = node(scene, Some(lower), DVec3::Y);
    // The node's own transform must not matter.
    let shown = node(scene, None, DVec3::new(70.0, -30.0, 5.0));
    let joint = |node, y: f64| Joint { node, joint_from_mesh: DAffine3::from_translation(DVec3::new(0.0, -y, 0.0)) };
    let own = Joint { node: shown, joint_from_mesh: DAffine3::IDENTITY };
    let deformer =
        Deformer { node: shown, joints: vec![joint(lower, 0.0), joint(upper, 1.0), own], weights: vec![0.0] };
    let share = |p: &Vec3| if p.y == 1.0 { 0.5 } else { f32::from(u8::from(p.y > 1.0)) };
    let skin = mesh.positions.iter().flat_map(|p| [(0, 1.0 - share(p)), (1, share(p))]).collect();
    let target = TargetDeltas {
        positions: mesh.positions.iter().map(|p| 0.5 * p.z * Vec3::Z).collect(),
        ..TargetDeltas::default()
    };
    let index = scene.deformers.len();
    let deform = Deform { deformer: index, targets: vec![target], influences: 2, skin, ..Deform::default() };
    mesh.deform = Some(Arc::new(deform));
    (mesh.name, mesh.material) = ("bar".into(), material);
    let world = |n: usize| DAffine3::from_translation([at, at + DVec3::Y, DVec3::new(70.0, -30.0, 5.0)][n - lower]);
    let all: Vec<DAffine3> = (0..=shown).map(|n| if n < lower { DAffine3::IDENTITY } else { world(n) }).collect();
    mesh.rest_in(&deformer.pose(&all, vec![0.0]));
    scene.deformers.push(deformer);
    scene.meshes.push(mesh);
    scene.instances.push(Instance { mesh: scene.meshes.len() - 1, node: shown });
    let turned = DQuat::from_rotation_z(FRAC_PI_2);
    let values = [DQuat::IDENTITY, turned].map(|q| Vec4::from_array(q.to_array().map(|x| x as f32))).to_vec();
    let (times, interpolation) = (vec![0.0, BENT], Interpolation::Linear);
    scene.animations.push(Animation {
        name: "bend".into(),
        duration: BENT,
        channels: vec![Channel {
            node: upper,
            times: times.clone(),
            property: Property::Rotation,
            values,
            interpolation,
        }],
        weights: vec![WeightChannel { deformer: index, times, values: vec![0.0, 1.0], width: 1, interpolation }],
    });
    scene.instances.len() - 1
}

fn bar() -> Scene {
    let mut scene = Scene::empty("bar");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.6)));
    add_bar(&mut scene, grey, DVec3::new(3.0, 1.0, 3.0));
    scene
}

/// The bar in a lit room, and a second bar that emits.
pub fn room() -> Scene {
    let mut scene = bar();
    scene.name = "room".into();
    let white = scene.add_material(Material::lambert("walls", Vec3::splat(0.7)));
    let red = scene.add_material(Material::lambert("floor", Vec3::new(0.8, 0.2, 0.1)));
    let glow = scene.add_material(Material::lamp("glow", Vec3::new(2.0, 4.0, 1.0)));
    let walls = Mesh::cuboid("walls", white, Vec3::ZERO, Vec3::new(6.0, 5.0, 6.0), true);
    scene.add_mesh(walls, DAffine3::IDENTITY);
    let floor = Mesh::quad("floor", red, Vec3::new(0.0, 0.05, 0.0), Vec3::Z * 6.0, Vec3::X * 6.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    add_bar(&mut scene, glow, DVec3::new(4.8, 1.5, 1.5));
    scene.add_light(LightKind::Point, Vec3::splat(20.0), DAffine3::from_translation(DVec3::new(1.5, 4.0, 3.0)));
    scene
}

fn both() -> Playback {
    Playback { animations: vec![0, 1], repeats: false }
}

pub fn view() -> View {
    View::look_at(DVec3::new(1.0, 2.5, 5.7), DVec3::new(3.5, 1.8, 2.0), DVec3::Y, 60f32.to_radians())
}

fn corners(scene: &Scene, pose: &Pose) -> Vec<DVec3> {
    let positions = scene.meshes[0].posed_positions(pose);
    positions.iter().map(|p| pose.world_from_instance[0].transform_point3(p.as_dvec3())).collect()
}

#[test]
fn a_bar_bends_at_its_joint() {
    let scene = bar();
    let deform = scene.meshes[0].deform.as_ref().expect("it deforms");
    let at = DVec3::new(3.0, 1.0, 3.0);
    for (time, angle, widened) in [(0.0, 0.0, 1.0), (0.5, FRAC_PI_2 / 2.0, 1.25), (1.0, FRAC_PI_2, 1.5)] {
        let pose = scene.pose(Some(0), time);
        let normals = scene.meshes[0].posed(&pose).normals.clone();
        for (v, corner) in corners(&scene, &pose).into_iter().enumerate() {
            let rest = deform.positions[v].as_dvec3() * DVec3::new(1.0, 1.0, widened);
            let (turn, pivot) = (DQuat::from_rotation_z(angle), DVec3::Y);
            let bent = pivot + turn * (rest - pivot);
            let expected = at
                + if rest.y > 1.0 {
                    bent
                } else if rest.y < 1.0 {
                    rest
                } else {
                    (rest + bent) / 2.0
                };
            assert!((corner - expected).length() < 1e-6, "vertex {v} at {time} s: {corner} for {expected}");
            if rest.y > 1.0 {
                let expected = (turn * deform.normals[v].as_dvec3()).as_vec3();
                assert!((normals[v] - expected).length() < 1e-6, "normal {v} at {time} s");
            }
        }
    }
    // The bounds are those of the visible positions: the bar turns by 90° towards −X, and a corner at its full distance
    // passes the lowest x on its way.
    let bounds = scene.bounds(Some(0));
    assert!((bounds.min.x - (3.0 - 1.0625f64.sqrt())).abs() < 1e-3, "{bounds:?}");
}

#[test]
fn weights_follow_their_keys() {
    let mut scene = bar();
    let channel = |interpolation, values: &[f32]| WeightChannel {
        deformer: 0,
        times: vec![1.0, 3.0],
        values: values.to_vec(),
        width: 1,
        interpolation,
    };
    let mut weight = |channel: WeightChannel, time: f32| {
        scene.animations[0].weights = vec![channel];
        scene.pose(Some(0), time).deforms[0].weights[0]
    };
    let step = channel(Interpolation::Step, &[0.25, 1.0]);
    assert_eq!([0.0, 2.9, 3.0].map(|t| weight(step.clone(), t)), [0.25, 0.25, 1.0]);
    let linear = channel(Interpolation::Linear, &[0.25, 1.0]);
    assert_eq!([1.0, 2.0, 9.0].map(|t| weight(linear.clone(), t)), [0.25, 0.625, 1.0]);
    // In-tangent, value, out-tangent per key. In the middle: ½·0 + ⅛·2·1 + ½·2 − ⅛·2·(−1) = 1.5.
    let cubic = channel(Interpolation::CubicSpline, &[0.0, 0.0, 1.0, -1.0, 2.0, 0.0]);
    assert_eq!([1.0, 2.0, 3.0].map(|t| weight(cubic.clone(), t)), [0.0, 1.5, 2.0]);
}

#[test]
fn animations_play_together_and_again() {
    let scene = room();
    let turn = |playback: &Playback, time: f64| scene.pose_of(playback, time).deforms.clone();
    let (one, again) = (Playback::once(Some(0)), Playback { repeats: true, ..both() });
    assert_ne!(turn(&one, 0.5)[0], turn(&one, 0.0)[0]);
    assert_eq!(turn(&one, 0.5)[1], turn(&one, 0.0)[1]);
    assert_ne!(turn(&both(), 0.5)[1], turn(&one, 0.5)[1]);
    assert_eq!(turn(&again, 2.5), turn(&both(), 0.5));
    assert_eq!(turn(&again, -0.25), turn(&both(), 0.75));
    assert_eq!(turn(&both(), 2.5), turn(&both(), 1.0));
}

fn renderer(scene: &Scene, settings: &Settings, size: u32, pose: &Pose) -> Renderer {
    let bounds = scene.bounds_of(&both());
    let options = RenderOptions::new((size, size), bounds);
    Renderer::new(&gpu::context(), scene.clone(), pose, settings.clone(), options).expect("it fits")
}

fn small(changes: &[&str]) -> Settings {
    gpu::with(Settings { voxels: 32, ..Settings::fast() }, changes)
}

/// Vertices of the device against the twin's. The order of operations is equal, but a driver may fuse multiplications
/// and additions: the tolerance is a few roundings of the largest number of a sum.
fn check_vertices(scene: &Scene, renderer: &Renderer, pose: &Pose) {
    let on_gpu = &renderer.ground().scene;
    let words: Vec<u32> = download(&gpu::context(), &on_gpu.vertices).expect("vertices");
    let stride = on_gpu.corner.vertex_bytes() / 4;
    let mut place = 0;
    for mesh in &scene.meshes {
        let posed = mesh.posed(pose);
        for (position, normal) in posed.positions.iter().zip(&posed.normals) {
            let read = |at: usize| Vec3::from_array([0, 1, 2].map(|k| f32::from_bits(words[place + at + k])));
            let (p, n) = (read(0), read(3));
            if mesh.deform.is_some() {
                assert!((p - *position).abs().max_element() <= 8.0 * f32::EPSILON * 2.5, "{p} for {position}");
                assert!((n - *normal).abs().max_element() <= 8.0 * f32::EPSILON, "{n} for {normal}");
            } else {
                assert_eq!((p, n), (*position, *normal));
            }
            place += stride;
        }
    }
    assert_eq!(place, words.len());
}

#[test]
fn the_device_deforms_as_its_twin_does() {
    let (mut scene, context) = (room(), gpu::context());
    // One of the two has the normals of its faces.
    let faceted = scene.meshes.last_mut().expect("a mesh that glows");
    let from = faceted.indices.clone();
    let triangles: Vec<[Vec3; 3]> = {
        let at = |i: u32| faceted.deform.as_ref().expect("it deforms").positions[i as usize];
        from.chunks_exact(3).map(|t| [at(t[0]), at(t[1]), at(t[2])]).collect()
    };
    let old = faceted.deform.clone().expect("it deforms");
    let mut new = Deform { deformer: old.deformer, influences: 2, flat: true, ..Deform::default() };
    new.skin = from.iter().flat_map(|&i| old.skin[2 * i as usize..][..2].to_vec()).collect();
    let offset = |i: &u32| old.targets[0].positions[*i as usize];
    new.targets = vec![TargetDeltas { positions: from.iter().map(offset).collect(), ..TargetDeltas::default() }];
    *faceted = Mesh::triangles("flat", faceted.material, &triangles);
    faceted.deform = Some(Arc::new(new));
    let rest = scene.pose(None, 0.0);
    scene.meshes.last_mut().expect("a mesh").rest_in(&rest.deforms[1]);

    let mut renderer = renderer(&scene, &small(&["bounces=1"]), 16, &rest);
    renderer.keep_log();
    for time in [0.0, 0.3, 1.0] {
        let pose = scene.pose_of(&both(), time);
        renderer.render(&pose, &view()).expect("a frame");
        check_vertices(&scene, &renderer, &pose);
        let deforms = |r: &Renderer| format!("{:?}", r.log()).matches("\"deform\"").count();
        assert!(deforms(&renderer) > 0, "the pass is in the frame");
        // An unchanged pose is not deformed again.
        renderer.render(&pose, &view()).expect("a frame");
        assert_eq!(deforms(&renderer), 0);
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    // A scene without deformers has neither the pass nor its buffers.
    let plan = |renderer: &Renderer| renderer.plan().rows.iter().filter(|row| row.0.starts_with("deform ")).count();
    assert_eq!(plan(&renderer), 2);
    scene.meshes.iter_mut().for_each(|mesh| mesh.deform = None);
    let still = gpu::render(&context, &scene, &small(&["bounces=1"]), 8);
    assert_eq!((plan(&still), format!("{:?}", still.log()).matches("\"deform\"").count()), (0, 0));
}

fn traced(scene: &Scene, pose: &Pose, size: u32) -> Layers {
    let (depth, stop) = (Depth::Bounces(2), Stop::Samples(128));
    let options = Options { width: size, height: size, depth, stop, seed: 1, occlusion: false };
    let (mut film, never) = (Film::new(size, size), AtomicBool::new(false));
    let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
    render(Still::new(scene, pose, &view()), &options, &mut film, control).expect("nothing interrupts");
    film.layers(&[])
}

fn difference(a: &Layers, b: &Layers) -> f64 {
    let light = |image: &Layers| image.beauty().iter().flatten().map(|x| f64::from(*x)).collect::<Vec<_>>();
    let (a, b) = (light(a), light(b));
    a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>() / b.iter().sum::<f64>()
}

#[test]
fn renderer_and_path_tracer_show_the_same_pose() {
    const SIZE: u32 = 64;
    let scene = room();
    let mut renderer = renderer(&scene, &small(&["rays.diffuse=32"]), SIZE, &scene.pose(None, 0.0));
    let mut before: Option<Layers> = None;
    for time in [0.0, 0.5, 1.0] {
        let pose = scene.pose_of(&both(), time);
        renderer.render(&pose, &view()).expect("a frame");
        let (image, truth) = (renderer.read(), traced(&scene, &pose, SIZE));
        let own = difference(&image, &truth);
        // Noise of 32 rays and 128 paths, edges of one sample a pixel, light in steps of a voxel of 19 cm.
        assert!(own < 0.10, "{own} at {time} s");
        // Another pose would differ much more: the moving lamp lights the walls.
        if let Some(before) = before {
            let others = difference(&before, &truth);
            assert!(others > 1.5 * own, "{others} for {own} at {time} s");
        }
        before = Some(image);
    }
    assert_eq!(gpu::context().take_validation_messages(), Vec::<String>::new());
}

fn bits(renderer: &Renderer) -> Vec<[u32; 3]> {
    renderer.read().beauty().iter().map(|p| p.map(f32::to_bits)).collect()
}

/// With two bounces no history is kept: one frame after a mesh stops or jumps, the image equals a new renderer's.
#[test]
fn a_pose_that_is_over_leaves_nothing() {
    let scene = room();
    for settings in [small(&[]), small(&["method=cones"]), small(&["method=photons"])] {
        let mut moving = renderer(&scene, &settings, 32, &scene.pose(None, 0.0));
        for time in [0.0, 0.4, 0.8, 0.2] {
            moving.render(&scene.pose_of(&both(), time), &view()).expect("a frame");
        }
        let pose = scene.pose_of(&both(), 0.2);
        let mut fresh = renderer(&scene, &settings, 32, &scene.pose(None, 0.0));
        // Directions differ from frame to frame only where a method jitters; both renderers are at the same frame
        // number.
        (0..4).for_each(|_| drop(fresh.render(&pose, &view()).expect("a frame")));
        assert!(bits(&moving) == bits(&fresh), "{}", settings.method);
    }
    assert_eq!(gpu::context().take_validation_messages(), Vec::<String>::new());
}

/// With all bounces a frame continues from the light before it, and the mean over passes begins after 64 frames without
/// motion. By then no light of another pose is left. A new renderer begins its mean when a frame changes by less than
/// [`SETTLED`]: the two may differ by that share of all light in either direction.
#[test]
fn all_bounces_forget_a_pose_in_frames_that_are_counted() {
    let scene = room();
    let settings = small(&["bounces=all", "rays.passes=1"]);
    let mut moving = renderer(&scene, &settings, 32, &scene.pose(None, 0.0));
    moving.render(&scene.pose_of(&both(), 1.0), &view()).expect("a frame");
    let pose = scene.pose_of(&both(), 0.2);
    let mut fresh = renderer(&scene, &settings, 32, &scene.pose(None, 0.0));
    fresh.render(&pose, &view()).expect("a frame");
    moving.render(&pose, &view()).expect("a frame");
    let first = difference(&moving.read(), &fresh.read());
    for _ in 0..MOST_SETTLING + 1 {
        moving.render(&pose, &view()).expect("a frame");
    }
    let last = difference(&moving.read(), &fresh.read());
    assert!(last < 2.0 * SETTLED && first > 5.0 * last, "{first}, then {last}");
    assert_eq!(gpu::context().take_validation_messages(), Vec::<String>::new());
}

/// Known poses of Khronos' samples, where the files are present.
#[test]
fn khronos_samples_take_their_known_poses() {
    let Some(folder) = std::env::var_os("TWOBOUNCE_GLTF_SAMPLES") else {
        eprintln!("skipped: TWOBOUNCE_GLTF_SAMPLES names no folder with Khronos' glTF sample models");
        return;
    };
    let load = |name: &str| {
        let path = Path::new(&folder).join(format!("{name}/glTF/{name}.gltf"));
        Scene::load(&path, &LoadOptions::default()).expect("a sample")
    };
    // SimpleMorph: weights (0,0), (0,1), (1,1), (1,0), (0,0) at 0 to 4 s; the targets move the top by (−1,1,0) and
    // (1,1,0).
    let morph = load("SimpleMorph");
    for (time, [a, b]) in
        [(0.0, [0.0, 0.0]), (1.0, [0.0, 1.0]), (1.5, [0.5, 1.0]), (2.0, [1.0, 1.0]), (3.0, [1.0, 0.0])]
    {
        let top =
            corners(&morph, &morph.pose(Some(0), time)).into_iter().max_by(|p, q| p.y.total_cmp(&q.y)).expect("three");
        let expected = DVec3::new(0.5 - a + b, 0.5 + a + b, 0.0);
        assert!((top - expected).length() < 1e-5, "{top} for {expected} at {time} s");
    }
}
