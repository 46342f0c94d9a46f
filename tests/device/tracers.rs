//! Both tracers give equal images: the tree, and the device's own queries where it has them. `rays_oracle.rs` checks
//! the hits of both.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use twobounce::Error;
use twobounce::ground::constants::Features;
use twobounce::renderer::Renderer;
use twobounce::scene::{Pose, Scene, View};
use twobounce::settings::{Settings, Tracer};
use twobounce::vk::Context;

use crate::gpu;
use crate::studio::{asset, moved_poses, room};
use crate::vk_common::Host;

const SIZE: u32 = 96;

fn by(tracer: Tracer, settings: &Settings) -> Settings {
    gpu::with(settings.clone(), &[&format!("rays.tracer={tracer}")])
}

/// The share of pixels of which an 8-bit channel differs by at least half a step.
fn differing(a: &[[f32; 3]], b: &[[f32; 3]]) -> usize {
    let encoded = |v: f32| v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0;
    let apart = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|k| (encoded(a[k]) - encoded(b[k])).abs() > 0.5);
    a.iter().zip(b).filter(|pair| apart(*pair)).count()
}

fn image(renderer: &mut Renderer, pose: &Pose, view: &View) -> Vec<[f32; 3]> {
    renderer.render(pose, view).expect("a frame");
    renderer.read().beauty().to_vec()
}

fn queries(renderer: &Renderer) -> bool {
    renderer.ground().desc.features.has(Features::QUERY)
}

/// Compares the images of all tracers with the tree's: at most this share of pixels may differ.
fn compare(context: &Arc<Context>, scene: &Scene, settings: &Settings, share: f64) {
    let image = |tracer: Tracer| {
        let view = scene.view(&scene.pose(None, 0.0), 0);
        let renderer = gpu::render_from(context, scene, &by(tracer, settings), SIZE, view);
        (renderer.read().beauty().to_vec(), queries(&renderer))
    };
    let (tree, of_tree) = image(Tracer::Tree);
    assert!(!of_tree && tree.iter().flatten().any(|v| *v > 0.01));
    let (auto, of_auto) = image(Tracer::Auto);
    assert_eq!(of_auto, context.has_ray_queries());
    let same = tree.iter().zip(&auto).filter(|(a, b)| a == b).count();
    let apart = differing(&tree, &auto);
    println!(
        "{}: by {}, {same} of {} pixels have the same bits, {apart} differ in 8",
        scene.name,
        if of_auto { "queries" } else { "the tree" },
        tree.len()
    );
    if of_auto {
        assert!(apart as f64 <= share * tree.len() as f64, "{}: {apart} of {} pixels differ", scene.name, tree.len());
        let (query, of_query) = image(Tracer::Query);
        assert!(of_query && query == auto, "{}: auto is queries", scene.name);
    } else {
        assert!(same == tree.len(), "{}: auto is the tree", scene.name);
    }
}

#[test]
fn images_do_not_depend_on_the_tracer() {
    let context = gpu::context();
    let settings = gpu::with(Settings::default(), &["voxels=32"]);
    for name in ["gallery.glb", "cornell-area.glb", "two-rooms.glb"] {
        compare(&context, &asset(name), &settings, 0.002);
    }
    let photons = gpu::with(Settings::preset("photons").expect("a preset"), &["voxels=32"]);
    compare(&context, &asset("cornell-point.glb"), &photons, 0.002);
}

#[test]
fn what_rays_go_through_follows_what_moves() {
    let (context, scene) = (gpu::context(), room());
    let settings = gpu::with(Settings::fast(), &["voxels=16"]);
    let view = View::look_at(DVec3::new(7.5, 6.5, 7.5), DVec3::splat(3.0), DVec3::Y, 1.4);
    for tracer in gpu::tracers(&context) {
        let settings = by(*tracer, &settings);
        let mut moving = gpu::render(&context, &scene, &settings, SIZE);
        let mut images = Vec::new();
        for pose in moved_poses(&scene) {
            let mut anew = gpu::render(&context, &scene, &settings, SIZE);
            let moved = image(&mut moving, &pose, &view);
            assert!(moved == image(&mut anew, &pose, &view), "by {tracer}");
            assert!(!images.contains(&moved), "by {tracer}: it moves");
            images.push(moved);
        }
    }
    gpu::assert_clean(&context);
}

#[test]
fn changing_the_tracer_is_as_a_renderer_of_its_own() {
    let (context, scene) = (gpu::context(), room());
    let settings = gpu::with(Settings::fast(), &["voxels=16"]);
    let mut changing = gpu::render(&context, &scene, &by(Tracer::Tree, &settings), SIZE);
    for tracer in gpu::tracers(&context).iter().rev() {
        let settings = by(*tracer, &settings);
        changing.change(settings.clone(), (SIZE, SIZE)).expect("it fits");
        assert_eq!(queries(&changing), *tracer == Tracer::Query);
        let (pose, view) = (scene.pose(None, 0.0), View::framing(scene.bounds(None)));
        let own = image(&mut gpu::render(&context, &scene, &settings, SIZE), &pose, &view);
        assert!(image(&mut changing, &pose, &view) == own, "by {tracer}");
    }
}

#[test]
fn scenes_of_nothing_and_of_flat_triangles_have_images() {
    let context = gpu::context();
    for tracer in gpu::tracers(&context) {
        let settings = by(*tracer, &gpu::with(Settings::fast(), &["voxels=16"]));
        let mut none = Scene::empty("none");
        none.sky = glam::Vec3::ONE;
        gpu::render(&context, &none, &settings, 8);
        // A scale of 0 leaves only one triangle of each side of the box.
        let mut flat = room();
        flat.nodes.iter_mut().for_each(|node| {
            node.local = twobounce::scene::Transform::Matrix(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)));
        });
        gpu::render(&context, &flat, &settings, 8);
    }
}

/// A host's device has only the required features enabled.
#[test]
fn a_device_without_queries_has_the_tree_and_refuses_queries() {
    let host = Host::new();
    let context = host.adopt(|_| ()).expect("everything is enabled that must be");
    assert!(!context.has_ray_queries());
    let settings = gpu::with(Settings::fast(), &["voxels=16"]);
    let renderer = gpu::render(&context, &room(), &by(Tracer::Auto, &settings), 8);
    assert!(!queries(&renderer));
    let scene = room();
    let options = twobounce::renderer::RenderOptions::new((8, 8), scene.bounds(None));
    let pose = scene.pose(None, 0.0);
    let refused = Renderer::new(&context, scene, &pose, by(Tracer::Query, &settings), options);
    let Err(Error::Device(message)) = refused else { panic!("it has none") };
    assert!(
        message.contains("rays.tracer = query") && message.contains("set rays.tracer to auto or tree"),
        "{message}"
    );
    assert!(!message.contains('\n') && !message.contains(". "), "one sentence: {message}");
    drop(renderer);
    drop(context);
    host.close();
}
