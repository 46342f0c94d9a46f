//! A sky from a map: the uniform sky, the directional light of its sun, the light that arrives on surfaces, and the
//! images of every method and of the path tracer, against closed forms and each other.

use crate::gpu;

use std::f64::consts::PI;

use crate::traced::film;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use twobounce::layers::{Aov, Layers};
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::sky::{Panorama, direction};
use twobounce::scene::{LightKind, Material, Mesh, Projection, Scene, View};
use twobounce::settings::Settings;

const SIZE: u32 = 24;
const METHODS: [&str; 5] = ["fast", "cones", "photons", "lpv", "none"];

fn settings(name: &str) -> Settings {
    match name {
        "none" => gpu::with(Settings::default(), &["method=none", "voxels=16"]),
        preset => Settings { voxels: 16, ..Settings::preset(preset).expect("a preset") },
    }
}

/// A map of this many rows.
fn map(height: usize, radiance: impl Fn(DVec3) -> Vec3) -> Panorama {
    let width = 2 * height;
    let place = |i: usize| ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    let texel = |i: usize| radiance(direction(place(i).0 / width as f64, place(i).1 / height as f64));
    Panorama { width, height, radiance: (0..width * height).map(texel).collect() }
}

fn under(name: &str, map: Panorama) -> Scene {
    let mut scene = Scene::empty(name);
    scene.set_sky_map(map, 1.0, 0.0);
    scene
}

/// A grey floor, tilted, and a view straight onto it.
fn add_floor(scene: &mut Scene, albedo: f32) -> (View, DVec3) {
    let grey = scene.add_material(Material { specular: 0.0, ..Material::lambert("grey", Vec3::splat(albedo)) });
    let tilt = DAffine3::from_rotation_x(0.6);
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, tilt);
    let normal = tilt.transform_vector3(DVec3::Y);
    let projection = Projection::Orthographic { half_height: 0.5, near: 0.01, far: 10.0 };
    (View { eye: normal, forward: -normal, up: tilt.transform_vector3(DVec3::Z), projection }, normal)
}

/// A sphere of radius ½ with smooth normals.
fn sphere(material: usize) -> Mesh {
    let rings = 24;
    let at = |x: usize, y: usize| 0.5 * direction(x as f64 / (2 * rings) as f64, y as f64 / rings as f64).as_vec3();
    let places = (0..rings).flat_map(|y| (0..2 * rings).map(move |x| (x, y)));
    let triangles: Vec<[Vec3; 3]> = places
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [(y > 0).then_some([a, b, c]), (y + 1 < rings).then_some([a, c, d])]
        })
        .flatten()
        .collect();
    let mesh = Mesh::triangles("sphere", material, &triangles);
    Mesh { normals: mesh.positions.iter().map(|p| p.normalize()).collect(), ..mesh }
}

/// A ball over a floor, with a wall behind.
fn add_ball(scene: &mut Scene, ball: Material) -> View {
    let grey = Material { double_sided: true, specular: 0.0, ..Material::lambert("grey", Vec3::splat(0.5)) };
    let grey = scene.add_material(grey);
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    let wall = Mesh::quad("wall", grey, Vec3::new(-1.5, 0.0, -1.2), Vec3::X * 3.0, Vec3::Y * 1.5);
    scene.add_mesh(wall, DAffine3::IDENTITY);
    let ball = scene.add_material(ball);
    scene.add_mesh(sphere(ball), DAffine3::from_translation(DVec3::Y * 0.5));
    View::look_at(DVec3::new(0.6, 1.6, 3.6), DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.8)
}

fn traced(scene: &Scene, view: &View, size: u32, samples: u32) -> Layers {
    let (depth, stop) = (Depth::Full, Stop::Samples(samples));
    let options = Options { width: size, height: size, depth, stop, seed: 0, occlusion: false };
    film(scene, view, &options).layers(&[Aov::Alpha])
}

fn mean(image: &Layers) -> Vec3 {
    image.beauty().iter().map(|p| Vec3::from(*p)).sum::<Vec3>() / image.beauty().len() as f32
}

/// Largest |found / expected − 1| over pixels and channels.
fn off(pixels: &[[f32; 3]], expected: impl Fn(usize) -> Vec3) -> f32 {
    let off = |(i, p): (usize, &[f32; 3])| (Vec3::from(*p) / expected(i) - 1.0).abs().max_element();
    pixels.iter().enumerate().map(off).fold(0.0, f32::max)
}

/// Mean |difference| over mean reference.
fn relative(image: &Layers, truth: &Layers) -> f32 {
    let pairs = || image.beauty().iter().zip(truth.beauty()).flat_map(|(a, b)| (0..3).map(move |c| (a[c], b[c])));
    pairs().map(|(a, b)| (a - b).abs()).sum::<f32>() / pairs().map(|(_, b)| b).sum::<f32>()
}

#[test]
fn a_map_that_is_the_same_everywhere_is_the_even_sky() {
    let radiance = Vec3::new(0.3, 0.7, 1.1);
    let mut even = Scene { sky: 2.0 * radiance, ..Scene::empty("even") };
    let mut mapped = Scene::empty("even");
    mapped.set_sky_map(map(4, |_| radiance), 2.0, 30.0);
    let context = gpu::context();
    let view = add_floor(&mut even, 0.5).0;
    add_floor(&mut mapped, 0.5);
    let shown = |scene: &Scene| gpu::render_from(&context, scene, &settings("fast"), SIZE, view).read();
    assert_eq!(shown(&even), shown(&mapped), "to the bit");
    assert_eq!(traced(&even, &view, 8, 4), traced(&mapped, &view, 8, 4), "to the bit");
}

/// One texel is darker in its last bit, so that the map is read.
#[test]
fn a_nearly_even_map_is_nearly_the_even_sky() {
    let radiance = Vec3::new(0.25, 0.5, 1.0);
    let mut nearly = map(32, |_| radiance);
    nearly.radiance[20].z -= 1.0 / 512.0;
    let mut scene = under("nearly", nearly);
    let view = add_floor(&mut scene, 0.5).0;
    let context = gpu::context();
    // `lpv`: cells near a slanting plane do not see all of the sky (tests/device/sky.rs).
    for (name, most, pays) in [
        ("fast", 1e-3, "half of one of 512 steps of a texel"),
        ("none", 1e-3, "half of one of 512 steps of a texel"),
        ("cones", 0.01, "what cones at a slant to the grid find of their own floor"),
        ("photons", 0.01, "what cones at a slant to the grid find of their own floor"),
    ] {
        let image = gpu::render_from(&context, &scene, &settings(name), SIZE, view).read();
        let off = off(image.beauty(), |_| 0.5 * radiance);
        assert!(off < most, "{name} is off by {off}: {pays}");
    }
}

#[test]
fn a_floor_sends_what_it_gets_of_a_soft_map() {
    let soft = map(64, |d| {
        (Vec3::new(0.6, 0.5, 0.6) + Vec3::new(0.5, 0.45, -0.5) * d.as_vec3()) * (1.2 + (3.0 * d.x).sin() as f32)
    });
    let mut scene = under("soft", soft);
    let (view, normal) = add_floor(&mut scene, 0.5);
    // Cosine-weighted mean, over a fine grid of directions.
    let mut expected = Vec3::ZERO;
    let rows = 200;
    for (x, y) in (0..rows).flat_map(|y| (0..2 * rows).map(move |x| (x, y))) {
        let d = direction((f64::from(x) + 0.5) / f64::from(2 * rows), (f64::from(y) + 0.5) / f64::from(rows));
        let solid_angle = (PI / f64::from(rows)).powi(2) * (1.0 - d.y * d.y).sqrt();
        expected += scene.sky_towards(d) * (0.5 / PI * solid_angle * d.dot(normal).max(0.0)) as f32;
    }
    let context = gpu::context();
    // Rays and cones have few directions. `lpv`: cells near a slanting plane do not see all of the sky
    // (tests/device/sky.rs).
    for (name, most) in [("fast", 0.05), ("cones", 0.1), ("photons", 0.1), ("none", 0.01)] {
        let image = gpu::render_from(&context, &scene, &settings(name), SIZE, view).read();
        let off = off(image.beauty(), |_| expected);
        println!("soft, {name}: {off:.4}");
        assert!(off < most, "{name} is off by {off}");
    }
    let found = mean(&traced(&scene, &view, SIZE, 64));
    assert!((found / expected - 1.0).abs().max_element() < 0.005, "traced: {found} of {expected}; 36,864 paths");
}

/// A sun of one texel among black ones, and the directional light of equal irradiance; both turned with the map.
#[test]
fn a_map_of_one_small_sun_is_a_directional_light() {
    let (height, radiance) = (128, Vec3::new(9000.0, 8000.0, 7000.0));
    let mut one = map(height, |_| Vec3::ZERO);
    let (x, y) = (150, 30);
    one.radiance[y * one.width + x] = radiance;
    let towards = direction((x as f64 + 0.5) / one.width as f64, (y as f64 + 0.5) / height as f64);
    let edge = |row: usize| (PI * row as f64 / height as f64).cos();
    let solid_angle = 2.0 * PI / one.width as f64 * (edge(y) - edge(y + 1));
    let ball = Material { roughness: 0.5, ..Material::lambert("ball", Vec3::new(0.7, 0.5, 0.3)) };
    let context = gpu::context();
    let turned = 130.0;
    let (mut sunny, mut lit) = (Scene::empty("sun"), Scene::empty("sun"));
    sunny.set_sky_map(one.clone(), 0.5, turned);
    let towards = DQuat::from_rotation_y(f64::to_radians(turned)) * towards;
    let shines = DAffine3::from_quat(DQuat::from_rotation_arc(DVec3::NEG_Z, -towards));
    let irradiance = 0.5 * radiance * solid_angle as f32;
    let light = lit.add_light(LightKind::Directional, irradiance, shines);
    // A disc of the same solid angle.
    lit.lights[light].radius = (1.0 - solid_angle / (2.0 * PI)).acos().tan() as f32;
    let view = add_ball(&mut sunny, ball.clone());
    add_ball(&mut lit, ball.clone());
    for name in METHODS.into_iter().filter(|name| *name != "cones") {
        // Under a sky `lpv` takes twice as many steps.
        let settings = settings(name);
        let settings = if name == "lpv" { gpu::with(settings, &["lpv.iterations=16"]) } else { settings };
        let shown = |scene: &Scene| gpu::render_from(&context, scene, &settings, SIZE, view).read();
        let off = relative(&shown(&sunny), &shown(&lit));
        println!("sun, {name}: {off:.5}");
        assert!(
            off < 2e-3,
            "{name}, turned by {turned}°: off by {off}: nine bits a channel, and the sine's mean over a texel"
        );
    }
    let ratio = mean(&traced(&sunny, &view, SIZE, 64)) / mean(&traced(&lit, &view, SIZE, 64));
    assert!(
        (ratio - 1.0).abs().max_element() < 0.02,
        "traced: {ratio}; the linear texel is twice as wide, and so is its penumbra"
    );
}

/// A sky with a sun and its glow over a ball: the methods' images against the path tracer's.
#[test]
fn under_an_outdoor_sky_the_methods_agree_with_the_path_tracer() {
    let sun = DVec3::new(0.5, 0.7, 0.6).normalize();
    let outdoor = map(128, |d| {
        let level = (1.0 - d.y.max(0.0)).powi(4) as f32 * 0.3;
        let sky = if d.y > 0.0 { Vec3::new(0.25, 0.4, 0.9) + level } else { Vec3::new(0.2, 0.15, 0.1) };
        let glow = 6.0 * d.dot(sun).max(0.0).powi(200) as f32;
        if d.dot(sun) > 0.9996 { Vec3::new(2500.0, 2200.0, 1800.0) } else { sky + glow }
    });
    let mut scene = under("outdoor", outdoor);
    let view = add_ball(&mut scene, Material { specular: 0.0, ..Material::lambert("ball", Vec3::splat(0.7)) });
    scene.sky_unseen = true;
    let truth = traced(&scene, &view, 2 * SIZE, 64);
    let context = gpu::context();
    for (name, most) in OUTDOOR {
        let image = gpu::render_from(&context, &scene, &settings(name), 2 * SIZE, view).read();
        let off = relative(&image, &truth);
        println!("outdoor, {name}: {off:.4}");
        assert!(off < most, "{name} is off by {off}");
    }
}

/// Tolerances for each method's own approximations, and for the noise of 64 paths a pixel: `none` has no occlusion of
/// the sky and no bounces, `lpv` six directions.
const OUTDOOR: [(&str, f32); 5] = [("fast", 0.09), ("cones", 0.08), ("photons", 0.08), ("lpv", 0.18), ("none", 0.12)];

/// A mirror, clear glass and the background show the map itself; pixels without a surface are transparent where the sky
/// is hidden.
#[test]
fn mirrors_and_the_background_show_the_map() {
    let lines = map(64, |d| Vec3::new(if (8.0 * d.x).sin() > 0.0 { 1.0 } else { 0.2 }, (0.5 + 0.5 * d.y) as f32, 0.3));
    let mut scene = under("lines", lines);
    let mirror = Material { metallic: 1.0, roughness: 0.0, specular: 1.0, ..Material::lambert("mirror", Vec3::ONE) };
    let mirror = scene.add_material(mirror);
    scene
        .add_mesh(Mesh::quad("mirror", mirror, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X), DAffine3::IDENTITY);
    let view =
        View { eye: DVec3::new(0.0, 1.0, 1.0), ..View::look_at(DVec3::new(0.0, 1.0, 1.0), DVec3::ZERO, DVec3::Y, 1.2) };
    let context = gpu::context();
    let size = 2 * SIZE;
    // `lpv` has six directions, and so have its mirrors.
    for name in METHODS.into_iter().filter(|name| *name != "lpv") {
        for unseen in [false, true].into_iter().filter(|unseen| !unseen || name == "fast") {
            scene.sky_unseen = unseen;
            let settings = gpu::with(settings(name), &["image.samples=1", "voxels=16"]);
            let image = gpu::render_layers(&context, &scene, &settings, size, view, vec![Aov::Alpha]).read();
            let alpha = image.get(Aov::Alpha).expect("a layer");
            for (i, (p, alpha)) in image.beauty().iter().zip(alpha).enumerate() {
                let mut d = view.direction(i, (size, size));
                let covered = alpha[0] == 1.0;
                if covered {
                    d.y = -d.y;
                }
                let expected = if unseen && !covered { Vec3::ZERO } else { scene.sky_towards(d) };
                // At a line of the map a direction's last bits decide.
                let near = [d + 2e-3 * DVec3::X, d - 2e-3 * DVec3::X].map(|d| scene.sky_towards(d.normalize()));
                let spread = (near[0] - near[1]).abs().max_element();
                let off = (Vec3::from(*p) - expected).abs().max_element();
                // Mirrors show the first level's blur between texels; cones look through glass with an equally narrow
                // cone.
                assert!(off < 0.01 + spread, "{name}, pixel {i}, alpha {}: {p:?} instead of {expected}", alpha[0]);
            }
            assert!(alpha.iter().any(|a| a[0] == 0.0) && alpha.iter().any(|a| a[0] == 1.0));
        }
    }
}
