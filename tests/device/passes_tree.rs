//! The bounding volume hierarchy for rays: it holds every triangle, also after motion. `rays_oracle.rs` checks that
//! rays find the same hits with it as without.

use crate::gpu;

use crate::scenes::{Random, add, triangle};
use glam::{DAffine3, DVec3, Vec3, Vec4};
use gpu::twins::tree::Tree;
use twobounce::scene::{
    Animation, Bounds, Channel, Instance, Interpolation, Material, Node, Property, Scene, Transform, View,
};
use twobounce::settings::{Bounces, Center, Method, Settings, Tracer};

const EDGE: u32 = 16;

fn settings() -> Settings {
    let mut settings = Settings { voxels: EDGE, bounces: Bounces::One, ..Settings::fast() };
    settings.grid.center = Center::Point([f64::from(EDGE) / 2.0; 3]);
    settings.grid.side = Some(f64::from(EDGE));
    settings.of.rays.tracer = Tracer::Tree;
    settings
}

/// Meshes of 1, 2, 3 and 300 triangles, some of them without area, each placed at `places`.
fn scene(places: &[DAffine3]) -> Scene {
    let mut random = Random::new(5);
    let mut scene = Scene::empty("crumbs");
    for count in [1, 2, 3, 300] {
        let mut crumbs: Vec<_> = (0..count)
            .map(|_| {
                let p = 2.0 + 12.0 * random.point();
                triangle(&mut random, p, 0.5)
            })
            .collect();
        if count == 3 {
            crumbs[1] = [crumbs[1][0]; 3];
        }
        add(&mut scene, &crumbs, Material::lamp("lamp", Vec3::ONE));
    }
    scene.instances.clear();
    for mesh in 0..scene.meshes.len() {
        for place in places {
            scene.instances.push(Instance { mesh, node: scene.nodes.len() });
            scene.nodes.push(Node { name: String::new(), parent: None, local: Transform::Matrix(*place) });
        }
    }
    scene
}

fn places() -> Vec<DAffine3> {
    vec![
        DAffine3::IDENTITY,
        DAffine3::from_translation(DVec3::new(1.0, 0.5, -0.3)),
        // A flat matrix without an inverse; a mirrored one; a rotated one; one outside of the volume.
        DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)),
        DAffine3::from_scale(DVec3::new(0.5, -0.5, 0.5)) * DAffine3::from_translation(DVec3::new(0.0, -20.0, 0.0)),
        DAffine3::from_axis_angle(DVec3::ONE.normalize(), 2.0),
        DAffine3::from_translation(DVec3::splat(100.0)),
    ]
}

#[test]
fn the_tree_holds_every_triangle() {
    let context = gpu::context();
    let renderer = gpu::render(&context, &scene(&places()), &settings(), 8);
    let held = Tree::of_renderer(&context, &renderer).check();
    // Flat triangles that stand upright have no area, nor has one of three; all others are in the tree.
    assert!((306 * 5 - 5..306 * 6).contains(&held), "{held}");
}

#[test]
fn a_tree_of_one_triangle_and_of_none() {
    let context = gpu::context();
    for count in [1, 2] {
        let mut one = Scene::empty("one");
        let mut random = Random::new(1);
        let crumbs: Vec<_> = (0..count).map(|_| triangle(&mut random, DVec3::splat(8.0), 1.0)).collect();
        add(&mut one, &crumbs, Material::lamp("lamp", Vec3::ONE));
        assert_eq!(Tree::of_renderer(&context, &gpu::render(&context, &one, &settings(), 8)).check(), count);
    }
    // Rays meet nothing: the image is the sky.
    let mut none = Scene::empty("none");
    none.sky = Vec3::ONE;
    gpu::render(&context, &none, &settings(), 8);
}

#[test]
fn boxes_follow_what_moves() {
    let context = gpu::context();
    let mut scene = scene(&places());
    // Of six places, the last three of each mesh move by an animation; the scene may move the others too.
    let nodes = (0..scene.nodes.len()).filter(|node| node % 6 >= 3);
    let channel = |node| Channel {
        node,
        times: vec![0.0],
        property: Property::Translation,
        values: vec![Vec4::ZERO],
        interpolation: Interpolation::Step,
    };
    scene.animations.push(Animation { channels: nodes.map(channel).collect(), ..Animation::default() });
    let mut renderer = gpu::render(&context, &scene, &settings(), 8);
    let mut pose = scene.pose(None, 0.0);
    let view = View::framing(Bounds { min: DVec3::ZERO, max: DVec3::splat(16.0) });
    for step in 0..3 {
        for (index, place) in pose.world_from_instance.iter_mut().enumerate() {
            *place = DAffine3::from_axis_angle(DVec3::Y, 0.1 * index as f64 * f64::from(step)) * *place;
        }
        renderer.render(&pose, &view).expect("a frame");
        assert!(Tree::of_renderer(&context, &renderer).check() > 306 * 5 - 6);
    }
}

/// A tree has at most 65,536 triangles, so static and moving triangles need several trees each.
#[test]
fn many_triangles_stand_in_several_trees() {
    const MANY: usize = 70_000;
    let context = gpu::context();
    let mut scene = Scene::empty("many");
    let mut random = Random::new(7);
    for _ in 0..2 {
        let crumbs: Vec<_> = (0..MANY)
            .map(|_| {
                let p = 2.0 + 12.0 * random.point();
                triangle(&mut random, p, 0.1)
            })
            .collect();
        add(&mut scene, &crumbs, Material::lamp("lamp", Vec3::ONE));
    }
    let channel = Channel {
        node: scene.instances[1].node,
        times: vec![0.0],
        property: Property::Translation,
        values: vec![Vec4::ZERO],
        interpolation: Interpolation::Step,
    };
    scene.animations.push(Animation { channels: vec![channel], ..Animation::default() });
    let mut renderer = gpu::render(&context, &scene, &Settings { method: Method::None, ..settings() }, 8);
    let mut pose = scene.pose(None, 0.0);
    let view = View::framing(Bounds { min: DVec3::ZERO, max: DVec3::splat(16.0) });
    for step in 0..2 {
        pose.world_from_instance[1] = DAffine3::from_axis_angle(DVec3::Y, 0.1 * f64::from(step));
        renderer.render(&pose, &view).expect("a frame");
        assert_eq!(Tree::of_renderer(&context, &renderer).check(), 2 * MANY);
    }
}
