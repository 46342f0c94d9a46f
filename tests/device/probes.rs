//! The method `probes` as a whole: images of scenes whose light is known. `passes_probes.rs` tests its passes.

use crate::gpu;
use crate::studio::{Studio, moved_poses, room};

use glam::{DAffine3, DVec3, Vec3};
use twobounce::layers::Aov;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Scene, View, analytic};
use twobounce::settings::Settings;

fn probes(changes: &[&str]) -> Settings {
    let base = ["image.gather_resolution=full", "probes.edge=8", "probes.rays=128"];
    gpu::with(Settings { voxels: 32, ..Settings::probes() }, &[&base, changes].concat())
}

fn mean(image: &[[f32; 3]]) -> f64 {
    image.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.len() as f64
}

/// A closed box whose walls emit light and have an albedo of a half: every probe has the same light in all directions.
#[test]
fn a_furnace_is_even() {
    for (bounces, expected) in [("bounces=1", 1.5), ("bounces=2", 1.75), ("bounces=all", 2.0)] {
        for block in [false, true] {
            let scene = analytic::furnace(0.5, 1.0, block);
            let view = scene.view(&scene.pose(None, 0.0), 0);
            let settings = probes(&["lights.lamps=gathered", bounces]);
            let image = gpu::render_from(&gpu::context(), &scene, &settings, 16, view).read();
            for p in image.beauty() {
                // The image has 16 bits per channel. With all bounces, feedback ends when a pass changes less than 0.1
                // %.
                let most = if bounces == "bounces=all" { 4e-3 } else { 1e-3 };
                assert!((f64::from(p[1]) / expected - 1.0).abs() < most, "{bounces}: {p:?} is not {expected}");
            }
        }
    }
}

/// A plate under a sky of radiance 1: the radiance of its front is its albedo, since the whole hemisphere is open.
#[test]
fn the_sky_arrives_whole() {
    let mut scene = Scene::empty("plate");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.add_mesh(
        Mesh::quad("plate", grey, Vec3::new(-0.02, 0.0, -0.02), Vec3::Z * 0.04, Vec3::X * 0.04),
        DAffine3::IDENTITY,
    );
    scene.sky = Vec3::ONE;
    let view = View::look_at(DVec3::Y * 0.06, DVec3::ZERO, DVec3::Z, 20f32.to_radians());
    for bounces in ["bounces=1", "bounces=2"] {
        let settings = probes(&["grid.side=1", "grid.center=0,0,0", bounces]);
        let renderer = gpu::render_layers(&gpu::context(), &scene, &settings, 8, view, vec![Aov::Ao]);
        let image = renderer.read();
        // Probes below the plate have small weights, and few of their rays meet it.
        let light = mean(image.beauty());
        assert!((light / 0.5 - 1.0).abs() < 0.02, "{light}");
        let open = mean(image.get(Aov::Ao).expect("a layer"));
        assert!((open - 1.0).abs() < 0.02, "{open}");
    }
}

/// The mean light of images from within two closed rooms beside each other, with a lamp in one. `wall`: metres between
/// the rooms.
fn two_rooms(wall: f32, double_sided: bool, changes: &[&str]) -> [f64; 2] {
    let mut scene = Scene::empty("two rooms");
    let material = Material { double_sided, ..Material::lambert("wall", Vec3::splat(0.7)) };
    let material = scene.add_material(material);
    for x in [-2.0 - 0.5 * wall, 0.5 * wall] {
        let (min, max) = (Vec3::new(x, -1.0, -1.0), Vec3::new(x + 2.0, 1.0, 1.0));
        scene.add_mesh(Mesh::cuboid("room", material, min, max, true), DAffine3::IDENTITY);
    }
    scene.add_light(LightKind::Point, Vec3::splat(5.0), DAffine3::from_translation(DVec3::new(-1.1, 0.0, 0.0)));
    let mean_at = |x: f64| {
        let view = View::look_at(DVec3::new(x, 0.3, 0.9), DVec3::new(x, 0.0, -1.0), DVec3::Y, 80f32.to_radians());
        mean(gpu::render_from(&gpu::context(), &scene, &probes(changes), 24, view).read().beauty())
    };
    [mean_at(-1.1), mean_at(1.1)]
}

#[test]
fn visibility_keeps_light_in_its_room() {
    for (wall, double_sided, most) in [(0.2, false, 1e-3), (0.2, true, 1e-3), (0.02, true, 5e-3)] {
        let [lit, dark] = two_rooms(wall, double_sided, &[]);
        println!("wall {wall}, double-sided {double_sided}: {}", dark / lit);
        // The moments resolve a wall only to a texel, 1/256 of the sphere.
        assert!(dark < most * lit, "wall {wall}, double-sided {double_sided}: {dark} of {lit}");
        let [lit, leaked] = two_rooms(wall, double_sided, &["probes.visibility=false"]);
        println!("without visibility {}", leaked / lit);
        assert!(leaked > 2e-3 * lit && leaked > 10.0 * dark, "without visibility it must leak: {leaked} of {lit}");
    }
}

/// In uniform light three grids give the light that one grid gives, for a scene that fills the coarsest grid.
#[test]
fn cascades_agree_in_even_light() {
    let scene = analytic::furnace(0.5, 1.0, false);
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let image = |cascades: &str| {
        let settings = probes(&["lights.lamps=gathered", "bounces=2", cascades]);
        mean(gpu::render_from(&gpu::context(), &scene, &settings, 16, view).read().beauty())
    };
    let (one, three) = (image("probes.cascades=1"), image("probes.cascades=3"));
    assert!((three / one - 1.0).abs() < 1e-3, "{three} is not {one}");
}

/// A studio whose camera is within the room.
fn in_the_room(scene: &Scene, settings: &Settings) -> Studio {
    let mut studio = Studio::new(scene, settings);
    let (eye, target) = (DVec3::new(4.0, 5.0, 7.8), DVec3::new(4.0, 3.0, 0.0));
    studio.view = View::look_at(eye, target, DVec3::Y, 80f32.to_radians());
    studio
}

/// Without feedback a frame does not depend on the frames before it. A renderer whose scene moved gives the image of a
/// new renderer, also where grids follow the camera.
#[test]
fn a_frame_after_others_is_a_frame_of_its_own() {
    let scene = room();
    for changes in [&["bounces=2"][..], &["bounces=1", "probes.cascades=2"]] {
        let settings = probes(changes);
        let mut kept = in_the_room(&scene, &settings);
        for pose in moved_poses(&scene) {
            let (after, _) = kept.image(&pose);
            let (alone, _) = in_the_room(&scene, &settings).image(&pose);
            assert!(after == alone && after.iter().any(|bits| *bits != 0), "{changes:?}");
        }
        kept.view.eye += 2.0 * kept.view.forward;
        let pose = &moved_poses(&scene)[2];
        let (after, _) = kept.image(pose);
        let mut fresh = in_the_room(&scene, &settings);
        fresh.view = kept.view;
        assert!(after == fresh.image(pose).0, "{changes:?}, the camera moved");
    }
}

/// With all bounces a moved scene converges to the light of a new renderer, whatever frames came before.
#[test]
fn feedback_ends_at_the_same_light() {
    let scene = room();
    let settings = probes(&["bounces=all", "probes.passes=0"]);
    let [here, there, _] = moved_poses(&scene);
    let numbers = |bits: Vec<u32>| bits.into_iter().map(f32::from_bits).map(f64::from).collect::<Vec<_>>();
    let mut kept = in_the_room(&scene, &settings);
    kept.image(&here);
    let mut after = vec![];
    for _ in 0..20 {
        after = numbers(kept.image(&there).0);
    }
    let alone = numbers(in_the_room(&scene, &settings).image(&there).0);
    let sum: f64 = alone.iter().sum();
    let apart: f64 = after.iter().zip(&alone).map(|(a, b)| (a - b).abs()).sum();
    // The iteration before the first frame ends when a pass changes less than 0.1 %.
    assert!(apart < 5e-3 * sum, "{apart} of {sum}");
}

/// The number of frames until the green channel of indirect light has made nine tenths of a change, after green light
/// grows tenfold. The brightest channel stays constant, and with it the scale of stored light.
fn lag(changes: &[&str]) -> usize {
    const FRAMES: usize = 90;
    let scene = analytic::furnace(0.5, 0.0, true);
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let lit = |green: f32| {
        let mut scene = scene.clone();
        let at = DAffine3::from_translation(DVec3::new(0.6, 0.7, 0.6));
        scene.add_light(LightKind::Point, Vec3::new(1.0, green, 1.0), at);
        scene
    };
    let (dim, bright) = (lit(0.1), lit(1.0));
    let settings = probes(&[&["bounces=all", "probes.edge=4", "probes.rays=64"], changes].concat());
    let pose = dim.pose(None, 0.0);
    let options = RenderOptions { aovs: vec![Aov::Indirect], ..RenderOptions::new((8, 8), dim.bounds(None)) };
    let mut renderer = Renderer::new(&gpu::context(), dim, &pose, settings, options).expect("it fits");
    let shown = |renderer: &mut Renderer, pose| {
        renderer.render(pose, &view).expect("a frame");
        mean(renderer.read().get(Aov::Indirect).expect("a layer"))
    };
    let before = shown(&mut renderer, &pose);
    let pose = bright.pose(None, 0.0);
    renderer.change_scene(bright, &pose, &[]).expect("a change");
    let frames: Vec<f64> = (0..FRAMES).map(|_| shown(&mut renderer, &pose)).collect();
    assert_eq!(gpu::context().take_validation_messages(), Vec::<String>::new());
    let after = frames[FRAMES - 1];
    // The iteration before the first frame leaves a change of 0.1 % per pass; means over few passes have a noise of 2
    // %.
    assert!((after / before - 10.0).abs() < 0.4, "{before}, then {after}");
    1 + frames.iter().position(|&now| (now - before) / (after - before) >= 0.9).expect("it arrives")
}

/// The lag of light in frames. Without hysteresis h it is that of the bounces; with it ln 0.1 / ln h is added. After 65
/// passes without another change, the mean of settled light replaces the lagging light.
#[test]
fn light_lags_as_hysteresis_says() {
    let found = ["0", "0.8", "0.97"].map(|h| lag(&[&format!("probes.hysteresis={h}")]));
    println!("{found:?} frames");
    assert!(found[0] <= 4, "{found:?}");
    // Feedback at an albedo of 0.5 lengthens the 10.3 frames of hysteresis up to twofold.
    assert!((10..=24).contains(&found[1]), "{found:?}");
    assert!((60..=68).contains(&found[2]), "{found:?}");
}

#[test]
fn too_many_probes_are_refused_in_a_sentence() {
    let scene = analytic::furnace(0.5, 1.0, false);
    let pose = scene.pose(None, 0.0);
    let options = RenderOptions::new((16, 16), scene.bounds(None));
    let settings = probes(&["probes.edge=32", "probes.cascades=3"]);
    let refused = Renderer::new(&gpu::context(), scene, &pose, settings, options).err().expect("a refusal").to_string();
    assert!(refused.contains("98304 probes of 128 rays need") && refused.contains("probes.rays lower"), "{refused}");
}
