//! The method `photons` as a whole: furnaces, feedback, and the error that falls with more cones.

use crate::gpu;
use crate::studio::asset;

use crate::traced::film;
use glam::{DAffine3, Vec3};
use gpu::twins::closed_forms;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::compare;
use twobounce::measure::terms::Subtract;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{Material, Mesh, Projection, Scene, View, analytic};
use twobounce::settings::{Bounces, Settings};

const SIZE: u32 = 32;

/// Mean and largest pixel of a furnace of albedo ½ over Σ½ᵏ.
fn furnace(block: bool, settings: &Settings) -> (f64, f64) {
    let scene = analytic::furnace(0.5, 1.0, block);
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let image = gpu::render_from(&gpu::context(), &scene, settings, SIZE, view).read();
    let truth = match settings.bounces {
        Bounces::One => closed_forms::furnace(0.5, 1),
        Bounces::Two => closed_forms::furnace(0.5, 2),
        Bounces::All => 2.0,
    };
    let ratios: Vec<f64> = image.beauty().iter().map(|p| f64::from(p[1]) / truth).collect();
    (ratios.iter().sum::<f64>() / ratios.len() as f64, ratios.iter().copied().fold(0.0, f64::max))
}

/// Settings without sampled lamps: those are not in the volumes, and in a furnace every wall is one.
fn gathered(settings: Settings, changes: &[&str]) -> Settings {
    gpu::with(settings, &[&["voxels=32", "lights.lamps=gathered"], changes].concat())
}

#[test]
fn a_furnace_keeps_its_energy_and_the_printed_form_loses_it() {
    for block in [false, true] {
        for bounces in ["bounces=1", "bounces=2", "bounces=all"] {
            let (mean, most) = furnace(block, &gathered(Settings::photons(), &[bounces]));
            // Spheres of growing cones see a wall as one wall up to a tenth, mostly in corners; a hundredth is f16's.
            assert!((0.95..=1.01).contains(&mean) && most < 1.01, "{bounces}, block {block}: {mean}, {most} at most");
        }
        let (printed, _) = furnace(block, &gathered(Settings::photons_printed(), &["bounces=2"]));
        // Directions at texels' middles, and dark backs, lose a twentieth each.
        assert!((0.85..0.95).contains(&printed), "as printed {printed}");
    }
}

/// Each of these settings alone takes a furnace further from the truth than the preset is.
#[test]
fn what_is_mended_shows_in_a_furnace() {
    let error = |changes: &[&str]| (1.0 - furnace(true, &gathered(Settings::photons(), changes)).0).abs();
    let right = error(&[]);
    for printed in [
        "photons.ledger.premultiplied=printed",
        "photons.ledger.directions=printed",
        "photons.composite=over",
        "photons.keep_backs=true",
    ] {
        let wrong = error(&[printed]);
        assert!(wrong > right + 0.005, "{printed}: {wrong} is no worse than {right}");
    }
    // One cone is wider than 45°: as printed there is no sphere after the first.
    let one = ["photons.diffuse=1", "image.interleave=1", "photons.ledger.steps=right"];
    let printed = ["photons.diffuse=1", "image.interleave=1", "photons.ledger.steps=printed"];
    assert!(error(&printed) > error(&one) + 0.05, "{} is no worse than {}", error(&printed), error(&one));
}

/// The light of a plane that slants across the grid before a void: its own light that it finds, over the light that it
/// sends.
fn self_light(start: &[&str]) -> f64 {
    let mut scene = Scene::empty("a plane that shines");
    let lamp = scene.add_material(Material { emissive: Vec3::ONE, ..Material::lambert("lamp", Vec3::splat(0.5)) });
    let (u, v) = (Vec3::new(2.0, 0.0, -1.0), Vec3::new(-1.0, 2.5, -2.0));
    scene.add_mesh(Mesh::quad("plane", lamp, -(u + v), 2.0 * u, 2.0 * v), DAffine3::IDENTITY);
    let normal = u.cross(v).normalize().as_dvec3();
    let projection = Projection::Orthographic { half_height: 0.5, near: 0.01, far: 10.0 };
    let view = View { eye: 3.0 * normal, forward: -normal, up: v.normalize().as_dvec3(), projection };
    let settings = gathered(Settings::photons(), &[&["bounces=1"], start].concat());
    let image = gpu::render_layers(&gpu::context(), &scene, &settings, SIZE, view, LAYERS.to_vec()).read();
    let found = image.get(Aov::Indirect).expect("the layer asked for");
    found.iter().map(|p| f64::from(p[1])).sum::<f64>() / found.len() as f64
}

#[test]
fn cones_start_far_enough_from_the_plane_that_they_leave() {
    let [preset, half, none] =
        ["1.5", "0.5", "0"].map(|voxels| self_light(&[&format!("photons.start_normal={voxels}")]));
    println!("light of its own that a plane finds: {preset:.4}, from half a voxel {half:.4}, from itself {none:.4}");
    // A slanting plane's voxels are a staircase: the truth is 0, but cones find 0.003, which filtering spreads past the
    // start.
    assert!(preset < 0.01 && half > 0.02 && none > half, "{preset}, {half}, {none}");
}

const LAYERS: [Aov; 2] = [Aov::Direct, Aov::Indirect];

fn truth(scene: &Scene, view: &View) -> Layers {
    let options = Options {
        width: SIZE,
        height: SIZE,
        depth: Depth::Bounces(2),
        stop: Stop::Samples(192),
        seed: 0,
        occlusion: false,
    };
    film(scene, view, &options).layers(&LAYERS)
}

#[test]
fn the_error_falls_as_cones_get_more() {
    let scene = asset("cornell-point.glb");
    let (pose, context) = (scene.pose(None, 0.0), gpu::context());
    let view = scene.view(&pose, 0);
    let truth = truth(&scene, &view);
    let options = RenderOptions { aovs: LAYERS.to_vec(), ..RenderOptions::new((SIZE, SIZE), scene.bounds(None)) };
    // Without sharing; neighbours that share have sixteen times as many.
    let alone = gpu::with(Settings::photons(), &["voxels=32", "image.interleave=1"]);
    let mut renderer = Renderer::new(&context, scene, &pose, alone.clone(), options).expect("it fits");
    let mut errors = Vec::new();
    for count in [1, 4, 16, 64] {
        let cones = format!("photons.diffuse={count}");
        renderer.change(gpu::with(alone.clone(), &[&cones]), (SIZE, SIZE)).expect("a change");
        renderer.render(&pose, &view).expect("a frame");
        let indirect =
            compare(&renderer.read(), &truth, Subtract::Own).expect("two images").indirect.expect("a direct layer");
        errors.push((count, indirect.rel, indirect.energy));
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    println!("cones, rel, energy of the indirect light: {errors:?}");
    assert!(errors.windows(2).all(|w| w[1].1 < w[0].1), "{errors:?}");
    // A fifth: voxels of a thirtieth of the room, and the reference's noise, about 3 %.
    assert!(errors[3].1 < 0.2 && (errors[3].2 - 1.0).abs() < 0.1, "{errors:?}");
}
