//! A frame's parts as a host uses them: several frames in flight in the host's own command buffers, and changes that
//! rebuild only what depends on them.

use crate::gpu;
use crate::vk_common;

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use twobounce::frame::{Frame, FrameDesc, Shot};
use twobounce::ground::image::target::Readback;
use twobounce::ground::scene_on_gpu::ScenePacked;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Pose, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, Recorder, RecorderOptions, Slot, SlotOptions};
use vk_common::Host;

const SIZE: (u32, u32) = (24, 16);

/// Whether the next frame rebuilds (lists, light).
fn made_anew(renderer: &mut Renderer, pose: &Pose, view: &View) -> (bool, bool) {
    let zones = renderer.render(pose, view).expect("a frame").timings.zones;
    let has = |name: &str| zones.iter().any(|zone| zone.name.starts_with(name));
    (has("record"), has("shade"))
}

/// A room with a box, a lamp and a light.
fn room() -> Scene {
    let mut scene = Scene::empty("room");
    let walls = scene.add_material(Material { double_sided: true, ..Material::lambert("walls", Vec3::splat(0.6)) });
    scene.add_mesh(Mesh::cuboid("walls", walls, Vec3::ZERO, Vec3::splat(4.0), true), DAffine3::IDENTITY);
    let red = scene.add_material(Material::lambert("box", Vec3::new(0.7, 0.2, 0.1)));
    scene.add_mesh(Mesh::cuboid("box", red, Vec3::splat(1.0), Vec3::splat(2.2), false), DAffine3::IDENTITY);
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(3.0)));
    let square = Mesh::quad("lamp", lamp, Vec3::new(2.5, 3.9, 1.0), Vec3::X, Vec3::Z);
    scene.add_mesh(square, DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::splat(8.0), DAffine3::from_translation(DVec3::new(3.0, 3.0, 3.0)));
    scene
}

fn from(eye: DVec3) -> View {
    View::look_at(eye, DVec3::splat(1.5), DVec3::Y, 1.2)
}

fn settings() -> Settings {
    gpu::with(Settings::fast(), &["voxels=16"])
}

fn bits(pixels: &[[f32; 3]]) -> Vec<u32> {
    pixels.iter().flatten().map(|v| v.to_bits()).collect()
}

fn renderer(context: &Arc<Context>, scene: &Scene, settings: &Settings, size: (u32, u32)) -> Renderer {
    let options = RenderOptions::new(size, room().bounds(None));
    Renderer::new(context, scene.clone(), &scene.pose(None, 0.0), settings.clone(), options).expect("it fits")
}

fn image(renderer: &mut Renderer, pose: &Pose, view: &View) -> Vec<u32> {
    renderer.render(pose, view).expect("a frame");
    bits(renderer.read().beauty())
}

#[test]
fn a_host_keeps_two_frames_in_flight_in_its_own_command_buffers() {
    let scene = room();
    let pose = scene.pose(None, 0.0);
    let views: Vec<View> = (0..6).map(|i| from(DVec3::new(3.5, 2.0 + 0.2 * f64::from(i), 3.4))).collect();
    let host = Host::new();
    let context = host.adopt(|_| ()).expect("everything is enabled");
    let mut found = Vec::new();
    {
        let settings = settings();
        let desc = FrameDesc {
            scene: &scene,
            settings: &settings,
            size: SIZE,
            outputs: 1,
            bounds: scene.bounds(None),
            slots: 2,
            query: None,
            waits: false,
        };
        let packed = Arc::new(ScenePacked::new(&scene, &pose).upload(&context).expect("an upload"));
        let mut frame = Frame::new(&context, &desc, &packed).expect("it fits");
        let commands = [0, 1].map(|_| vk_common::HostFrame::new(&host));
        let mut slots = [0, 1].map(|_| Slot::new(&context, SlotOptions::default()).expect("a slot"));
        let readbacks = [0, 1]
            .map(|_| Readback::new(&context, frame.target.size(), frame.target.shape().outputs).expect("a readback"));
        let taken = context.allocated_bytes();
        for (i, view) in views.iter().enumerate() {
            let slot = i % 2;
            commands[slot].wait();
            if i >= 2 {
                assert!(frame.poll(slot).1.is_none(), "nothing overflows");
                found.push(bits(readbacks[slot].read(&[]).beauty()));
            }
            commands[slot].begin();
            // SAFETY: the buffer is recording and the slot's last frame was waited for.
            unsafe {
                Recorder::on(&context, commands[slot].commands, &mut slots[slot], |recorder| {
                    frame.record(recorder, slot, &Shot { scene: &scene, pose: &pose, view, image: Some(0) });
                    readbacks[slot].record(recorder, &frame.target);
                });
            }
            commands[slot].submit(&host);
        }
        assert_eq!(context.allocated_bytes(), taken, "a frame takes no memory");
        for slot in 0..2 {
            commands[slot].wait();
            found.push(bits(readbacks[slot].read(&[]).beauty()));
        }
    }
    assert_eq!(host.take_messages(), Vec::<String>::new());
    drop(context);
    host.close();
    // Each image equals that of a renderer of its own, frame by frame.
    let context = gpu::context();
    let mut renderer = renderer(&context, &scene, &settings(), SIZE);
    for (i, view) in views.iter().enumerate() {
        assert!(image(&mut renderer, &pose, view) == found[i], "frame {i}");
    }
}

#[test]
fn growth_that_fails_halfway_leaves_a_frame_that_draws() {
    let (context, scene, settings) = (gpu::own_context(), room(), settings());
    let (pose, view) = (scene.pose(None, 0.0), from(DVec3::new(3.5, 2.0, 3.4)));
    let (size, bounds) = (SIZE, scene.bounds(None));
    let desc =
        FrameDesc { scene: &scene, settings: &settings, size, outputs: 1, bounds, slots: 1, query: None, waits: false };
    let packed = Arc::new(ScenePacked::new(&scene, &pose).upload(&context).expect("an upload"));
    let mut frame = Frame::new(&context, &desc, &packed).expect("it fits");
    let readback = Readback::new(&context, size, 1).expect("a readback");
    let draw = |frame: &mut Frame| {
        let mut recorder = Recorder::new(&context, RecorderOptions::default()).expect("a recorder");
        frame.record(&mut recorder, 0, &Shot::new(&scene, &pose, &view));
        readback.record(&mut recorder, &frame.target);
        recorder.finish().expect("a frame");
        bits(readback.read(&[]).beauty())
    };
    let whole = draw(&mut frame);
    // The triangles get new buffers; the items need more than any device binds.
    let before = frame.counts().clone();
    let mut counts = before.clone();
    counts.triangle_capacity *= 100;
    counts.lists[0].items = u32::MAX;
    frame.grow(&context, counts).expect_err("it does not fit");
    assert!(*frame.counts() == before, "what did not grow is not counted on");
    assert!(draw(&mut frame) == whole);
    gpu::assert_clean(&context);
}

/// Timestamps of work that is submitted in parts cover nearly all of its wall-clock time: the host's submissions and
/// waits take the rest, a fifth here where nothing else runs. Because other tests run at the same time, the device is
/// opened once more, with a queue of its own, and the best of up to ten frames counts.
#[test]
fn device_time_is_nearly_all_of_a_frame_that_is_cut_into_parts() {
    let (context, scene) = (gpu::own_context(), room());
    let settings = gpu::with(settings(), &["rays.diffuse=128"]);
    let (pose, view) = (scene.pose(None, 0.0), from(DVec3::new(3.5, 2.0, 3.4)));
    let options = RenderOptions { responsive: true, ..RenderOptions::new((192, 144), scene.bounds(None)) };
    let mut renderer = Renderer::new(&context, scene, &pose, settings, options).expect("it fits");
    // The first frame learns the times of its parts.
    renderer.render(&pose, &view).expect("a frame");
    let mut share = || {
        renderer.make_anew();
        let timings = renderer.render(&pose, &view).expect("a frame").timings;
        timings.gpu_ms / timings.wall_ms
    };
    let mut shares = vec![];
    while shares.len() < 10 && shares.iter().all(|share| *share <= 0.45) {
        shares.push(share());
    }
    assert!(shares.iter().all(|share| *share <= 1.0), "{shares:?}");
    assert!(shares.iter().any(|share| *share > 0.45), "{shares:?} of the frames are the device's time");
    gpu::assert_clean(&context);
}

#[test]
fn a_change_keeps_what_does_not_depend_on_it() {
    let context = gpu::context();
    let scene = room();
    let pose = scene.pose(None, 0.0);
    let view = from(DVec3::new(3.5, 2.0, 3.4));
    let mut kept = renderer(&context, &scene, &settings(), SIZE);
    assert_eq!(made_anew(&mut kept, &pose, &view), (true, true), "the first frame");
    assert_eq!(made_anew(&mut kept, &pose, &view), (false, false), "nothing changed");
    let cases = [
        ("image.samples=4", (false, false)),
        ("rays.diffuse=3", (false, true)),
        ("lights.shadow_rays=3", (false, true)),
        ("voxels=32", (true, true)),
        ("method=none", (true, false)),
    ];
    for (set, expected) in cases {
        kept.change(gpu::with(settings(), &[set]), SIZE).expect("it fits");
        assert_eq!(made_anew(&mut kept, &pose, &view), expected, "{set}");
        kept.change(settings(), SIZE).expect("it fits");
        kept.render(&pose, &view).expect("a frame");
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}

#[test]
fn what_was_set_before_compiles_nothing() {
    let context = gpu::own_context();
    let scene = room();
    let first = context.compiled_pipelines();
    drop(renderer(&context, &scene, &settings(), SIZE));
    let all = context.compiled_pipelines();
    assert!(all > first + 10, "a frame of {} pipelines", all - first);
    drop(renderer(&context, &scene, &settings(), SIZE));
    assert_eq!(context.compiled_pipelines(), all, "the same again");
    let mut kept = renderer(&context, &scene, &gpu::with(settings(), &["lights.shadow_rays=3"]), SIZE);
    let changed = context.compiled_pipelines();
    assert!(changed > all, "another constant");
    kept.change(settings(), SIZE).expect("it fits");
    assert_eq!(context.compiled_pipelines(), changed, "and back");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}

#[test]
fn what_changes_is_as_if_made_new() {
    let context = gpu::context();
    let scene = room();
    let pose = scene.pose(None, 0.0);
    let view = from(DVec3::new(3.5, 2.0, 3.4));
    let mut kept = renderer(&context, &scene, &settings(), SIZE);
    let mut shown = image(&mut kept, &pose, &view);
    // Changes of settings and sizes.
    let mut changes: Vec<(Vec<&str>, (u32, u32))> = vec![(vec![], (40, 24))];
    let sets: [&[&str]; 8] = [
        &["image.samples=4"],
        &["image.gather_resolution=full"],
        &["rays.diffuse=3"],
        &["rays.diffuse=3", "bounces=all"],
        &["lights.lamp_points=2", "bounces=all"],
        &["method=cones", "image.interleave=1"],
        &["voxels=32"],
        &["bounces=1", "method=none"],
    ];
    changes.extend(sets.iter().map(|set| (set.to_vec(), (40, 24))));
    for (set, size) in changes {
        let settings = gpu::with(settings(), &set);
        kept.change(settings.clone(), size).expect("it fits");
        let found = image(&mut kept, &pose, &view);
        assert!(found == image(&mut renderer(&context, &scene, &settings, size), &pose, &view), "{set:?}");
        assert!(found != shown, "{set:?} does not show");
        shown = found;
    }
    // Changes of the scene: a light, the sky, a material, a lamp's light, vertices.
    kept.change(settings(), SIZE).expect("it fits");
    let mut scene = room();
    // The room is closed: its sky is not visible.
    type Edit = (&'static str, fn(&mut Scene), &'static [usize]);
    let edits: [Edit; 6] = [
        ("light", |s| s.lights[0].intensity *= 2.0, &[]),
        ("sky", |s| s.sky = Vec3::splat(0.5), &[]),
        ("material", |s| s.materials[2].base_color.y = 0.8, &[]),
        ("lamp", |s| s.materials[3].emissive *= 3.0, &[]),
        ("one more lamp", |s| s.materials[2].emissive = Vec3::new(0.0, 0.4, 0.1), &[]),
        ("vertices", |s| s.meshes[1].positions.iter_mut().for_each(|p| p.y *= 1.4), &[1]),
    ];
    let mut shown = image(&mut kept, &pose, &view);
    for (what, edit, moved) in edits {
        edit(&mut scene);
        kept.change_scene(scene.clone(), &pose, moved).expect("it fits");
        let found = image(&mut kept, &pose, &view);
        assert!(found == image(&mut renderer(&context, &scene, &settings(), SIZE), &pose, &view), "{what}");
        assert!(found != shown || what == "sky", "{what} does not show");
        shown = found;
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}
