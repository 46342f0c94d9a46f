//! The method `paths` against the CPU's path tracer, with which it shares the scene and no code. Their means agree
//! within the noise of both, per pixel and over the image, for every kind of light and material. Further tests compare
//! two runs bit by bit, render a furnace, and check the estimate of noise.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use twobounce::layers::Aov;
use twobounce::profile::RepeatedFrame;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::finish::{Anisotropy, Clearcoat, DiffuseTransmission, Finish, Iridescence, Sheen};
use twobounce::scene::sky::Panorama;
use twobounce::scene::{
    Alpha, LightKind, Material, Mesh, Mip, Playback, Pose, Projection, Scene, Still, Texture, TextureImage, TextureRef,
    View, Wrap,
};
use twobounce::settings::Settings;

use crate::gpu;
use crate::more;
use crate::studio::asset;
use crate::{deform, gloss, traced};

/// The number of independent parts of both means; the spread of the parts measures the noise.
const PARTS: u32 = 32;

/// A scene, a camera and the number of samples.
struct Case {
    scene: Scene,
    pose: Pose,
    view: View,
    size: u32,
    /// Samples per pixel and part, for both renderers.
    samples: u32,
    bounces: &'static str,
}

impl Case {
    fn new(scene: Scene) -> Self {
        let pose = scene.pose(None, 0.0);
        let view = if scene.cameras.is_empty() { View::framing(scene.bounds(None)) } else { scene.view(&pose, 0) };
        Self { scene, pose, view, size: 32, samples: 4, bounces: "all" }
    }

    fn from(self, eye: [f64; 3], target: [f64; 3], degrees: f64) -> Self {
        let view = View::look_at(eye.into(), target.into(), DVec3::Y, degrees.to_radians() as _);
        Self { view, ..self }
    }

    fn bounces(self, bounces: &'static str) -> Self {
        Self { bounces, ..self }
    }
}

/// One image per part: RGB radiance per pixel.
type Parts = Vec<Vec<[f32; 3]>>;

fn settings(case: &Case) -> Settings {
    let own = ["paths.paths=1".to_owned(), format!("bounces={}", case.bounces)];
    gpu::with(Settings::preset("paths").expect("a preset"), &own.each_ref().map(String::as_str))
}

/// Images of the method. A part is the mean of some passes with one path per pixel, from the difference of two means.
/// Each pass has its own sample positions within pixels, so the number of passes grows rather than that of paths.
fn by_paths(case: &Case) -> Parts {
    let context = gpu::context();
    let options = RenderOptions::new((case.size, case.size), case.scene.bounds(None));
    let mut renderer =
        Renderer::new(&context, case.scene.clone(), &case.pose, settings(case), options).expect("the scene fits");
    let mut sums: Vec<[f64; 3]> = vec![[0.0; 3]; (case.size * case.size) as usize];
    let mut parts = Vec::new();
    for pass in 1..=PARTS * case.samples {
        if pass == 1 {
            renderer.render_now(&case.pose, &case.view).expect("a frame");
        } else {
            renderer.refine(&case.pose, &case.view).expect("a frame");
        }
        if pass % case.samples > 0 {
            continue;
        }
        let mean = renderer.read();
        let part = mean.beauty().iter().zip(&mut sums).map(|(pixel, sum)| {
            std::array::from_fn(|c| {
                let all = f64::from(pixel[c]) * f64::from(pass);
                ((all - std::mem::replace(&mut sum[c], all)) / f64::from(case.samples)) as f32
            })
        });
        parts.push(part.collect());
    }
    gpu::assert_clean(&context);
    parts
}

/// Images of the CPU's path tracer. Each part has its own random numbers.
fn by_reference(case: &Case) -> Parts {
    let depth = match case.bounces {
        "all" => Depth::Full,
        bounces => Depth::Bounces(bounces.parse().expect("a number")),
    };
    let part = |seed: u32| {
        let stop = Stop::Samples(case.samples);
        let seed = u64::from(seed) + 1;
        let options = Options { width: case.size, height: case.size, depth, stop, seed, occlusion: false };
        let still = Still::new(&case.scene, &case.pose, &case.view);
        traced::film_of(still, &options).layers(&[]).beauty().to_vec()
    };
    (0..PARTS).map(part).collect()
}

/// The mean of the parts, and the variance of that mean.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = f64::from(PARTS);
    let mean = values.clone().sum::<f64>() / n;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)))
}

/// The limit that |t| of Student's distribution with `freedom` degrees of freedom exceeds with probability `p`.
fn t_limit(freedom: f64, p: f64) -> f64 {
    // With t = √freedom · tan a, the density over a is proportional to cos^(freedom − 1) a.
    const STEPS: usize = 20_000;
    let density = |a: f64| a.cos().powf(freedom - 1.0);
    let step = PI / 2.0 / STEPS as f64;
    let all: f64 = (0..STEPS).map(|i| density((i as f64 + 0.5) * step)).sum();
    let mut tail = 0.0;
    for i in (0..STEPS).rev() {
        tail += density((i as f64 + 0.5) * step);
        if tail > p * all {
            return freedom.sqrt() * (i as f64 * step).tan();
        }
    }
    0.0
}

/// The probability that a test of a whole image fails by chance.
const CHANCE: f64 = 0.0025;

/// The result of a comparison.
#[derive(Debug)]
struct Verdict {
    /// The largest |t| of a channel of a pixel.
    largest: f64,
    /// The limit of `largest`, with Bonferroni's correction for the number of channels and pixels.
    limit: f64,
    /// The largest |t| of the image's mean among the channels.
    whole: f64,
    /// The limit of `whole`.
    whole_limit: f64,
    /// Relative difference of the images' means.
    apart: f64,
}

fn compare(a: &Parts, b: &Parts) -> Verdict {
    let freedom = f64::from(PARTS - 1);
    let pixels = a[0].len();
    let t = |of: &dyn Fn(&Vec<[f32; 3]>) -> f64| {
        let (of_a, of_b) = (a.iter().map(of).collect::<Vec<_>>(), b.iter().map(of).collect::<Vec<_>>());
        let ((x, vx), (y, vy)) = (moments(of_a.into_iter()), moments(of_b.into_iter()));
        // The larger variance stands for both: a renderer that misses a rare bright path underestimates its variance
        // too. The tolerance without noise is the rounding of f32 and 1 % of a step of 8 bits.
        let rounding = (1e-5 * x.abs().max(y.abs()) + 4e-5 * 1e-2).powi(2);
        (x - y).abs() / (2.0 * vx.max(vy) + rounding).sqrt()
    };
    let mut largest: f64 = 0.0;
    let mut whole: f64 = 0.0;
    for c in 0..3 {
        for p in 0..pixels {
            largest = largest.max(t(&|part: &Vec<[f32; 3]>| f64::from(part[p][c])));
        }
        whole = whole.max(t(&|part: &Vec<[f32; 3]>| part.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels as f64));
    }
    let mean = |parts: &Parts| parts.iter().flatten().flatten().map(|v| f64::from(*v)).sum::<f64>();
    Verdict {
        largest,
        limit: t_limit(freedom, CHANCE / (3 * pixels) as f64),
        whole,
        whole_limit: t_limit(freedom, CHANCE / 3.0),
        apart: mean(a) / mean(b) - 1.0,
    }
}

/// Whether both renderers agree on a case.
fn holds(case: &Case) -> bool {
    let begins = std::time::Instant::now();
    let own = by_paths(case);
    let after = begins.elapsed();
    let truth = by_reference(case);
    let verdict = compare(&own, &truth);
    let paths = f64::from(case.size * case.size * PARTS * case.samples);
    println!(
        "{}, {} bounces: mean {:+.3} %, t {:.2} of {:.2}; pixels t {:.2} of {:.2}; {:.2} s, {:.2} M paths/s; reference {:.2} s",
        case.scene.name,
        case.bounces,
        100.0 * verdict.apart,
        verdict.whole,
        verdict.whole_limit,
        verdict.largest,
        verdict.limit,
        after.as_secs_f64(),
        1e-6 * paths / after.as_secs_f64(),
        (begins.elapsed() - after).as_secs_f64(),
    );
    if let Some(folder) = std::env::var_os("TWOBOUNCE_TEST_PICTURES") {
        write_pictures(case, [&own, &truth], std::path::Path::new(&folder));
    }
    verdict.largest < verdict.limit && verdict.whole < verdict.whole_limit
}

/// Compares all cases before it fails.
fn hold(cases: impl Iterator<Item = Case>) {
    let apart: Vec<String> = cases.filter(|case| !holds(case)).map(|case| case.scene.name).collect();
    assert!(apart.is_empty(), "not the path tracer's mean: {apart:?}");
}

fn write_pictures(case: &Case, both: [&Parts; 2], folder: &std::path::Path) {
    for (parts, name) in both.into_iter().zip(["paths", "reference"]) {
        let mean = |p: usize| std::array::from_fn(|c| parts.iter().map(|part| part[p][c]).sum::<f32>() / PARTS as f32);
        let beauty = (0..parts[0].len()).map(mean).collect();
        let layers = twobounce::layers::Layers::new(case.size, case.size, beauty);
        let path = folder.join(format!("{}-{}-{name}.exr", case.scene.name.replace(' ', "-"), case.bounces));
        layers.write_exr(&path, &std::collections::BTreeMap::new()).expect("it is written");
    }
}

/// A room of side 4 with an open front, whose walls have different albedos.
fn walls(scene: &mut Scene) {
    let quads = [
        ("floor", Vec3::new(0.7, 0.7, 0.6), Vec3::new(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0),
        ("back", Vec3::new(0.6, 0.65, 0.7), Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Y * 4.0),
        ("left", Vec3::new(0.6, 0.2, 0.1), Vec3::new(-2.0, 0.0, 2.0), Vec3::Z * -4.0, Vec3::Y * 4.0),
        ("right", Vec3::new(0.1, 0.3, 0.6), Vec3::new(2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::Y * 4.0),
    ];
    for (name, albedo, corner, u, v) in quads {
        let material = scene.add_material(Material::lambert(name, albedo));
        scene.add_mesh(Mesh::quad(name, material, corner, u, v), DAffine3::IDENTITY);
    }
}

fn lamp(scene: &mut Scene, radiance: Vec3) {
    let lamp = scene.add_material(Material::lamp("lamp", radiance));
    let quad = Mesh::quad("lamp", lamp, Vec3::new(-0.7, 3.9, -0.7), Vec3::X * 1.4, Vec3::Z * 1.4);
    scene.add_mesh(quad, DAffine3::IDENTITY);
}

/// The room of `walls` with two rows of three spheres.
fn balls(name: &str, materials: Vec<Material>) -> Case {
    let mut scene = Scene::empty(name);
    walls(&mut scene);
    lamp(&mut scene, Vec3::new(9.0, 8.0, 7.0));
    for (i, material) in materials.into_iter().enumerate() {
        let material = scene.add_material(material);
        let at = DVec3::new(-1.2 + 1.2 * (i % 3) as f64, 0.7 + 1.2 * (i / 3) as f64, -0.3 * (i / 3) as f64);
        let ball = gloss::sphere(material, 0.5, 3);
        scene.add_mesh(ball, DAffine3::from_translation(at));
    }
    Case::new(scene).from([0.0, 1.7, 5.5], [0.0, 1.5, 0.0], 40.0)
}

fn finished(material: Material, finish: Finish) -> Material {
    Material { finish: Some(Box::new(finish)), ..material }
}

fn finishes() -> Case {
    let red = || Material { specular: 1.0, roughness: 0.6, ..Material::lambert("red", Vec3::new(0.6, 0.1, 0.1)) };
    let metal = |roughness: f32| Material {
        metallic: 1.0,
        specular: 1.0,
        roughness,
        ..Material::lambert("metal", Vec3::new(0.9, 0.7, 0.4))
    };
    let clearcoat = |roughness: f32| Clearcoat { factor: 0.9, roughness, ..Clearcoat::default() };
    let sheen = Sheen { color: Vec3::new(0.3, 0.5, 0.8), roughness: 0.4, ..Sheen::default() };
    let anisotropy = Anisotropy { strength: 0.8, rotation: 0.5, texture: None };
    let iridescence = Iridescence { factor: 1.0, ..Iridescence::default() };
    let diffuse_transmission =
        DiffuseTransmission { factor: 0.6, color: Vec3::new(0.3, 0.8, 0.3), ..DiffuseTransmission::default() };
    balls(
        "finishes",
        vec![
            finished(red(), Finish { clearcoat: clearcoat(0.3), ..Finish::default() }),
            finished(red(), Finish { clearcoat: clearcoat(0.1), sheen: sheen.clone(), ..Finish::default() }),
            finished(red(), Finish { sheen, ..Finish::default() }),
            finished(metal(0.3), Finish { anisotropy, ..Finish::default() }),
            finished(metal(0.25), Finish { iridescence, ..Finish::default() }),
            finished(red(), Finish { diffuse_transmission, ..Finish::default() }),
        ],
    )
}

fn glasses() -> Case {
    let glass = |roughness: f32, thickness: f32| Material {
        ior: 1.5,
        roughness,
        specular: 1.0,
        transmission: 1.0,
        thickness,
        attenuation_color: Vec3::new(0.7, 0.9, 0.8),
        attenuation_distance: 0.8,
        ..Material::lambert("glass", Vec3::new(0.95, 0.9, 0.85))
    };
    let dispersion = Finish { dispersion: 5.0, ..Finish::default() };
    let half = Material { transmission: 0.5, ..glass(0.3, 1.0) };
    balls(
        "glasses",
        vec![
            glass(0.0, 1.0),
            glass(0.4, 1.0),
            finished(glass(0.0, 1.0), dispersion),
            Material { double_sided: true, ..glass(0.0, 0.0) },
            Material { double_sided: true, ..glass(0.4, 0.0) },
            half,
        ],
    )
}

/// A texture of `side`² texels, bilinear.
fn texture(scene: &mut Scene, side: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Option<TextureRef> {
    let rgba = (0..side * side).flat_map(|i| texel(i % side, i / side)).collect();
    scene.images.push(TextureImage { name: "texels".into(), width: side, height: side, rgba });
    let wrap = [Wrap::Repeat, Wrap::Repeat];
    let image = scene.images.len() - 1;
    scene.textures.push(Texture { image, wrap, mag_linear: true, min_linear: true, mip: Mip::Linear });
    let texture = scene.textures.len() - 1;
    Some(TextureRef { texture, uv_set: 0, transform: glam::Affine2::from_scale(Vec2::splat(2.0)) })
}

/// A scene with an alpha-masked fence, two blended veils one behind the other, a pane, and a textured lamp.
fn veils() -> Case {
    let mut scene = Scene::empty("veils");
    walls(&mut scene);
    let checks = texture(&mut scene, 8, |x, y| if (x / 2 + y / 2) % 2 == 0 { [255; 4] } else { [40, 90, 200, 30] });
    let picture = texture(&mut scene, 4, |x, y| [255, (60 * x) as u8, (60 * y) as u8, 255]);
    let sheet = |name: &str, albedo: Vec3| Material { double_sided: true, ..Material::lambert(name, albedo) };
    let fence = Material { base_color_texture: checks, alpha: Alpha::Mask(0.5), ..sheet("fence", Vec3::splat(0.8)) };
    let veil = Material {
        base_color: Vec4::new(0.9, 0.4, 0.3, 0.6),
        base_color_texture: checks,
        alpha: Alpha::Blend,
        ..sheet("veil", Vec3::ONE)
    };
    let pane = Material { transmission: 0.8, roughness: 0.0, specular: 1.0, ..sheet("pane", Vec3::new(0.6, 0.9, 0.7)) };
    let glow = Material { emissive_texture: picture, ..Material::lamp("glow", Vec3::new(9.0, 9.0, 9.0)) };
    let [fence, veil, pane, glow] = [fence, veil, pane, glow].map(|material| scene.add_material(material));
    let mut quad = |material: usize, corner: [f32; 3], u: [f32; 3], v: [f32; 3]| {
        let mesh = Mesh::quad("sheet", material, corner.into(), u.into(), v.into());
        scene.add_mesh(mesh, DAffine3::IDENTITY);
    };
    quad(fence, [-1.8, 0.2, -0.5], [1.4, 0.0, 0.3], [0.0, 1.8, 0.0]);
    quad(veil, [-0.6, 0.3, 0.2], [1.2, 0.0, 0.0], [0.0, 1.5, 0.0]);
    quad(veil, [-0.3, 0.6, -0.6], [1.2, 0.0, 0.2], [0.0, 1.7, 0.1]);
    quad(pane, [0.7, 0.2, 0.3], [1.1, 0.0, -0.4], [0.0, 1.6, 0.0]);
    quad(glow, [-0.9, 3.8, -0.9], [1.8, 0.0, 0.0], [0.0, 0.0, 1.8]);
    let light = DAffine3::from_translation(DVec3::new(1.2, 3.0, 1.0));
    let light = scene.add_light(LightKind::Point, Vec3::new(3.0, 3.0, 4.0), light);
    scene.lights[light].radius = 0.2;
    Case::new(scene).from([0.0, 1.7, 5.5], [0.0, 1.3, 0.0], 40.0)
}

/// A sky map with a sun and a softbox over a metal ball, a diffuse one and a rough dielectric on a floor.
fn sky(turned: f64) -> Case {
    let mut scene = Scene::empty("sky map");
    let sun = DVec3::new(0.5, 0.7, 0.4).normalize();
    let texel = |d: DVec3| {
        let of_sky = Vec3::new(0.3, 0.4, 0.7) * (0.6 + 0.4 * d.y as f32);
        let is_sun = d.dot(sun) > 0.995;
        let in_box = (d - DVec3::new(-0.7, 0.3, 0.64)).abs().max_element() < 0.15;
        of_sky
            + if is_sun { Vec3::new(60.0, 50.0, 40.0) } else { Vec3::ZERO }
            + Vec3::splat(8.0 * f32::from(in_box as u8))
    };
    let (width, height) = (64, 32);
    let place = |i: usize| ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    let towards = |i: usize| twobounce::scene::sky::direction(place(i).0 / width as f64, place(i).1 / height as f64);
    let radiance = (0..width * height).map(|i| texel(towards(i))).collect();
    scene.set_sky_map(Panorama { width, height, radiance }, 1.0, turned);
    let floor = scene.add_material(Material::lambert("floor", Vec3::new(0.5, 0.45, 0.4)));
    let quad = Mesh::quad("floor", floor, Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::Z * -6.0);
    scene.add_mesh(quad, DAffine3::IDENTITY);
    let metal =
        Material { metallic: 1.0, roughness: 0.15, specular: 1.0, ..Material::lambert("metal", Vec3::splat(0.9)) };
    let lacquer = Material { roughness: 0.4, specular: 1.0, ..Material::lambert("lacquer", Vec3::new(0.1, 0.3, 0.2)) };
    let dull = Material::lambert("dull", Vec3::splat(0.7));
    for (i, material) in [metal, lacquer, dull].into_iter().enumerate() {
        let material = scene.add_material(material);
        let at = DVec3::new(-1.2 + 1.2 * i as f64, 0.5, 0.0);
        scene.add_mesh(gloss::sphere(material, 0.5, 3), DAffine3::from_translation(at));
    }
    Case::new(scene).from([0.0, 1.6, 4.5], [0.0, 0.5, 0.0], 40.0)
}

/// Lights of every kind, with and without a radius, in a room with so many small lamps that they are sampled through
/// the tree.
fn lights() -> Case {
    let mut scene = Scene::empty("lights");
    walls(&mut scene);
    let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    let down = DAffine3::from_rotation_x(-PI / 2.0);
    let ball = scene.add_light(LightKind::Point, Vec3::new(3.0, 1.0, 1.0), at(-1.0, 1.5, 0.5));
    scene.lights[ball].radius = 0.3;
    scene.add_light(LightKind::Point, Vec3::new(1.0, 3.0, 1.0), at(1.2, 2.5, 0.0));
    scene.add_light(LightKind::Spot { inner: 0.3, outer: 0.6 }, Vec3::splat(12.0), at(0.0, 3.5, 0.0) * down);
    let sun = DAffine3::from_rotation_y(0.6) * DAffine3::from_rotation_x(-0.5);
    let sun = scene.add_light(LightKind::Directional, Vec3::new(0.4, 0.4, 0.8), sun);
    scene.lights[sun].radius = 0.1;
    for i in 0..24u32 {
        let strength = 1.0 + (i % 5) as f32;
        let glow = scene.add_material(Material {
            double_sided: i % 4 == 0,
            ..Material::lamp("glow", Vec3::new(strength, 0.5 * strength, 2.0))
        });
        let (x, z) = ((i % 6) as f32 * 0.6 - 1.6, (i / 6) as f32 * 0.8 - 1.6);
        let quad = Mesh::quad("glow", glow, Vec3::new(x, 3.0, z), Vec3::X * 0.2, Vec3::Z * 0.2);
        scene.add_mesh(quad, DAffine3::IDENTITY);
    }
    let lacquer = Material { roughness: 0.3, specular: 1.0, ..Material::lambert("lacquer", Vec3::new(0.2, 0.3, 0.5)) };
    let lacquer = scene.add_material(lacquer);
    let block = Mesh::cuboid("block", lacquer, Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.6, 1.2, 0.3), false);
    scene.add_mesh(block, DAffine3::from_rotation_y(0.4));
    Case::new(scene).from([0.0, 1.7, 5.5], [0.0, 1.5, 0.0], 40.0)
}

/// An animated skin and morph target on two bars, one of which emits light.
fn skins() -> Case {
    let scene = Scene { name: "skins".into(), ..deform::room() };
    let playback = Playback { animations: vec![0, 1], repeats: false };
    let pose = scene.pose_of(&playback, 0.6);
    Case { pose, view: deform::view(), ..Case::new(scene) }
}

fn even_sky() -> Case {
    let mut scene = gloss::corner();
    scene.sky_gradient = Vec3::new(0.2, 0.4, 0.6);
    Case::new(scene)
}

/// The ten cases; the quick test renders all of them at 32² pixels.
fn cases() -> Vec<Case> {
    let of_asset = |name: &str| Case::new(asset(name));
    vec![
        of_asset("cornell-point.glb"),
        // The edges of a visible lamp need more sample positions within pixels.
        Case { samples: 12, ..of_asset("cornell-area.glb").bounces("1") },
        of_asset("gallery.glb"),
        of_asset("two-rooms.glb").bounces("2"),
        Case::new(gloss::spheres(true)),
        Case::new(gloss::spheres(false)).bounces("2"),
        even_sky(),
        sky(30.0),
        lights(),
        finishes(),
        glasses(),
        veils(),
        skins(),
    ]
}

#[test]
fn its_mean_is_the_path_tracers() {
    hold(cases().into_iter());
}

#[test]
#[ignore = "minutes: `make test-more`"]
fn its_mean_is_the_path_tracers_at_length() {
    if !more::all() {
        return;
    }
    let assets = ["corridor.glb", "thick-walls.glb", "stairs.glb", "demo.glb"].map(|name| Case::new(asset(name)));
    hold(cases().into_iter().chain(assets).map(|case| Case { size: 64, samples: 16, ..case }));
}

#[test]
fn the_same_bits_twice() {
    let case = Case { size: 24, samples: 2, ..finishes() };
    assert!(by_paths(&case) == by_paths(&case));
}

/// A CPU device ends an invocation's loops after 65535 rounds, counted over all its rays together. The largest number
/// of paths per pixel and pass ends before that.
#[test]
fn no_path_is_cut_off() {
    let context = gpu::counting();
    let case = Case::new(asset("gallery.glb"));
    let subject = RepeatedFrame {
        scene: &case.scene,
        pose: &case.pose,
        view: &case.view,
        settings: gpu::with(Settings::preset("paths").expect("a preset"), &["paths.paths=16", "rays.tracer=tree"]),
        options: RenderOptions::new((24, 24), case.scene.bounds(None)),
        check: || Ok(()),
    };
    let rows = subject.count(&context).expect("a frame");
    gpu::assert_clean(&context);
    let image = rows.iter().find(|row| row.0 == "image").expect("the pass that follows paths").1;
    println!("{} rays, {} steps, {} cut off", image.rays, image.ray_steps, image.rays_cut);
    assert!(image.rays > 24 * 24 * 16 * 4, "{} rays are a test of little", image.rays);
    assert_eq!(image.rays_cut, 0);
}

/// A closed room of albedo a that emits radiance 1 everywhere has the radiance 1 / (1 − a); with limited bounces, a
/// partial sum of the powers of a.
#[test]
fn a_furnace_is_as_bright_as_its_albedo_says() {
    for (bounces, expected) in [("1", 1.0 + 0.5 + 0.25), ("2", 1.875), ("all", 2.0)] {
        let mut scene = Scene::empty("furnace");
        let grey = scene.add_material(Material {
            emissive: Vec3::ONE,
            specular: 0.0,
            ..Material::lambert("grey", Vec3::splat(0.5))
        });
        let room = Mesh::cuboid("room", grey, Vec3::splat(-1.0), Vec3::ONE, true);
        scene.add_mesh(room, DAffine3::IDENTITY);
        let case = Case { size: 16, samples: 8, ..Case::new(scene) }.from([0.0; 3], [0.3, 0.2, -1.0], 60.0);
        let parts = by_paths(&Case { bounces, ..case });
        let mean = parts.iter().flatten().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * 256 * PARTS) as f64;
        let of_parts =
            |part: &Vec<[f32; 3]>| part.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * 256) as f64;
        let (_, variance) = moments(parts.iter().map(of_parts).collect::<Vec<_>>().into_iter());
        println!("{bounces} bounces: {mean:.5} ± {:.5}, expected {expected}", variance.sqrt());
        assert!((mean - expected).abs() < 4.0 * variance.sqrt() + 1e-4, "{bounces} bounces: {mean}");
    }
}

/// A smooth sphere of clear glass under a uniform sky shows that sky, for any number of reflections within it.
#[test]
fn clear_glass_loses_nothing() {
    let mut scene = Scene { sky: Vec3::ONE, ..Scene::empty("clear") };
    let glass = Material {
        transmission: 1.0,
        thickness: 1.0,
        roughness: 0.0,
        specular: 1.0,
        ..Material::lambert("glass", Vec3::ONE)
    };
    let glass = scene.add_material(glass);
    scene.add_mesh(gloss::sphere(glass, 1.0, 4), DAffine3::IDENTITY);
    let view = View {
        projection: Projection::Orthographic { half_height: 1.2, near: 0.01, far: 10.0 },
        ..View::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, 1.0)
    };
    let parts = by_paths(&Case { size: 16, samples: 8, view, ..Case::new(scene) });
    let mean = parts.iter().flatten().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * 256 * PARTS) as f64;
    println!("clear glass: {mean:.5}");
    assert!((mean - 1.0).abs() < 0.005, "{mean}");
}

/// The estimate of an image's noise, half the difference of its even and odd passes, matches its error.
#[test]
fn its_noise_is_its_error() {
    let case = Case { size: 32, samples: 1, ..Case::new(asset("cornell-point.glb")) };
    let context = gpu::context();
    let options = RenderOptions::new((case.size, case.size), case.scene.bounds(None));
    let pixels = |passes: u32, paths: u32| {
        let own = [format!("image.passes={passes}"), format!("paths.paths={paths}")];
        let settings = gpu::with(settings(&case), &own.each_ref().map(String::as_str));
        let mut renderer =
            Renderer::new(&context, case.scene.clone(), &case.pose, settings, options.clone()).expect("it fits");
        let report = renderer.render(&case.pose, &case.view).expect("a frame");
        (renderer.read().get(Aov::Beauty).expect("an image").to_vec(), report.noise.expect("several passes"))
    };
    let (image, noise) = pixels(64, 1);
    let (truth, _) = pixels(256, 16);
    let pairs = image.iter().zip(&truth).map(|(a, b)| {
        let [a, b] = [a, b].map(|p| DVec3::from_array(p.map(f64::from)));
        (a, a - b)
    });
    let error = twobounce::layers::relative_noise(pairs.collect::<Vec<_>>().into_iter());
    println!("noise {noise:.4}, error {error:.4}");
    // The estimate has one difference for each of 1024 pixels, and a few bright paths weigh as much as all others.
    assert!((noise / error - 1.0).abs() < 0.25, "noise {noise}, error {error}");
}
