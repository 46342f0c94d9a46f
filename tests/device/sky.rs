//! The sky: its gradient in the image, on surfaces and in the path tracer, against closed forms; and warnings of scenes
//! without light.

use crate::gpu;

use crate::traced::film;
use glam::{DAffine3, DVec3, Vec3};
use twobounce::layers::{Aov, Layers};
use twobounce::reference::{Depth, Options, Stop, lights_itself};
use twobounce::scene::{Material, Mesh, Projection, Scene, View};
use twobounce::settings::Settings;

const SIZE: u32 = 24;
const SKY: Vec3 = Vec3::new(0.5, 1.0, 2.0);
const GRADIENT: Vec3 = Vec3::new(0.3, 0.2, 1.5);

fn under_the_sky(name: &str) -> Scene {
    Scene { sky: SKY, sky_gradient: GRADIENT, ..Scene::empty(name) }
}

fn traced(scene: &Scene, view: &View, samples: u32) -> Layers {
    let (depth, stop) = (Depth::Full, Stop::Samples(samples));
    let options = Options { width: SIZE, height: SIZE, depth, stop, seed: 0, occlusion: false };
    film(scene, view, &options).layers(&[Aov::Direct])
}

/// Largest |found / expected − 1| over pixels and channels.
fn off(pixels: &[[f32; 3]], expected: impl Fn(usize) -> Vec3) -> f32 {
    let off = |(i, p): (usize, &[f32; 3])| (Vec3::from(*p) / expected(i) - 1.0).abs().max_element();
    pixels.iter().enumerate().map(off).fold(0.0, f32::max)
}

#[test]
fn what_no_surface_covers_shows_the_sky_there() {
    // A scene cannot be empty: it has a speck above the cameras.
    let mut scene = under_the_sky("sky");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::quad("speck", grey, Vec3::Y * 60.0, Vec3::Z, Vec3::X), DAffine3::IDENTITY);
    let context = gpu::context();
    for (target, samples) in [(DVec3::new(3.0, 4.0, -5.0), 1), (DVec3::new(-2.0, -9.0, 1.0), 4)] {
        let view = View::look_at(DVec3::new(0.0, 50.0, 0.0), DVec3::new(0.0, 50.0, 0.0) + target, DVec3::Y, 1.2);
        let settings = gpu::with(Settings { voxels: 16, ..Settings::fast() }, &[&format!("image.samples={samples}")]);
        let image = gpu::render_layers(&context, &scene, &settings, SIZE, view, vec![Aov::Direct, Aov::Depth]).read();
        let sky = |pixel| scene.sky_towards(view.direction(pixel, (SIZE, SIZE)));
        for layer in [Aov::Beauty, Aov::Direct] {
            let off = off(image.get(layer).expect("a layer"), sky);
            assert!(off < 1e-5, "{layer:?} is off by {off}: rounding of f32 directions");
        }
        assert!(image.get(Aov::Depth).expect("a layer").iter().all(|d| *d == [f32::INFINITY; 3]));
        // The path tracer samples points all over a pixel: of 4096, and a few per cent of difference across it.
        let off = off(traced(&scene, &view, 64).beauty(), sky);
        assert!(off < 0.02, "traced, it is off by {off}");
    }
}

/// Each channel of the sky passes a pane by the pane's transmission of that channel; the mean of the three gave a grey
/// sky behind red glass.
#[test]
fn a_floor_under_coloured_glass_gets_the_sky_in_its_colour() {
    const GLASS: Vec3 = Vec3::new(0.9, 0.2, 0.05);
    let mut scene = Scene { sky: SKY, ..Scene::empty("glass") };
    let grey = scene.add_material(Material { specular: 0.0, ..Material::lambert("grey", Vec3::splat(0.5)) });
    // An index of 1 reflects nothing.
    let pane = Material {
        transmission: 1.0,
        ior: 1.0,
        roughness: 0.0,
        double_sided: true,
        ..Material::lambert("pane", GLASS)
    };
    let pane = scene.add_material(pane);
    let quad = |name: &str, material, y: f32| {
        Mesh::quad(name, material, Vec3::new(-4.0, y, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0)
    };
    scene.add_mesh(quad("floor", grey, 0.0), DAffine3::IDENTITY);
    scene.add_mesh(quad("pane", pane, 0.05), DAffine3::IDENTITY);
    let projection = Projection::Orthographic { half_height: 0.3, near: 1e-3, far: 1.0 };
    let view = View { eye: DVec3::Y * 0.04, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    let settings = gpu::with(Settings { voxels: 16, ..Settings::default() }, &["bounces=1", "rays.diffuse=32"]);
    let image = gpu::render_layers(&gpu::context(), &scene, &settings, SIZE, view, vec![]).read();
    // 1 part in 1600 of the sky comes in beside the pane.
    let off = off(image.beauty(), |_| 0.5 * SKY * GLASS);
    assert!(off < 0.02, "it is off by {off}");
}

#[test]
fn a_floor_sends_what_it_gets_of_the_gradient() {
    let mut scene = under_the_sky("floor");
    let grey = scene.add_material(Material { specular: 0.0, ..Material::lambert("grey", Vec3::splat(0.5)) });
    let tilt = DAffine3::from_rotation_x(0.6);
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, tilt);
    let normal = tilt.transform_vector3(DVec3::Y);
    let projection = Projection::Orthographic { half_height: 0.5, near: 0.01, far: 10.0 };
    let view = View { eye: normal, forward: -normal, up: tilt.transform_vector3(DVec3::Z), projection };
    // Over the hemisphere, the cosine-weighted mean of a function that is linear in the direction is 2/3 of its value
    // along the normal.
    let expected = 0.5 * (SKY + GRADIENT * (2.0 / 3.0 * normal.y) as f32);
    let context = gpu::context();
    // Rays and cones have few directions: their mean height is off by one or two hundredths. `lpv`: cells near a
    // slanting plane do not see all of the sky.
    for (name, most) in [("fast", 0.02), ("balanced", 0.01), ("cones", 0.03), ("photons", 0.03)] {
        let settings = Settings { voxels: 32, ..Settings::preset(name).expect("a preset") };
        let off = off(gpu::render_from(&context, &scene, &settings, SIZE, view).read().beauty(), |_| expected);
        assert!(off < most, "{name} is off by {off}");
    }
    let image = traced(&scene, &view, 256);
    let mean = image.beauty().iter().map(|p| Vec3::from(*p)).sum::<Vec3>() / (SIZE * SIZE) as f32;
    // 147,456 paths.
    assert!((mean / expected - 1.0).abs().max_element() < 0.005, "traced: {mean} of {expected}");
}

#[test]
fn a_lamp_lights_a_room_and_a_label_does_not() {
    let emitting = |side: f32, up: f32| {
        let mut scene = Scene::empty("room");
        let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
        let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(10.0)));
        scene.add_mesh(Mesh::cuboid("walls", grey, Vec3::splat(-1.0), Vec3::splat(1.0), true), DAffine3::IDENTITY);
        let corner = Vec3::new(-0.5 * side, up, -0.5 * side);
        scene.add_mesh(Mesh::quad("lamp", lamp, corner, Vec3::X * side, Vec3::Z * side), DAffine3::IDENTITY);
        let view = View::look_at(DVec3::new(0.3, 0.2, 0.9), DVec3::new(0.0, -0.2, 0.0), DVec3::Y, 1.0);
        lights_itself(&scene, &scene.pose(None, 0.0), &view).expect("it can be traced")
    };
    // A lamp of 20 cm under the ceiling shines down; one below the floor lights no visible surface.
    assert!(emitting(0.2, 0.98));
    assert!(!emitting(0.2, -1.1));
}
