//! The method `paths` against the CPU's path tracer, with which it shares the scene and no code. Their means agree
//! within the noise of both, per pixel and over the image, for every kind of light and material. Further tests compare
//! two runs bit by bit, render a furnace, and check the estimate of noise.

mod cases;

use std::f64::consts::PI;

use glam::{DAffine3, DVec3, Vec3};
use twobounce::layers::Aov;
use twobounce::profile::RepeatedFrame;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{Material, Mesh, Projection, Scene, Still, View};
use twobounce::settings::Settings;

use crate::gpu;
use crate::more;
use crate::studio::asset;
use crate::{gloss, traced};
use cases::{Case, cases, finishes};

/// The number of independent parts of both means; the spread of the parts measures the noise.
const PARTS: u32 = 32;

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

/// The paths of a pixel in one pass are independent: sixteen times as many have a quarter of the noise.
#[test]
fn sixteen_paths_have_a_quarter_of_the_noise() {
    let case = Case { size: 32, samples: 1, ..Case::new(asset("cornell-point.glb")) };
    let context = gpu::context();
    let noise = |paths: u32| {
        let own = ["image.passes=32".to_owned(), format!("paths.paths={paths}")];
        let settings = gpu::with(settings(&case), &own.each_ref().map(String::as_str));
        let options = RenderOptions::new((case.size, case.size), case.scene.bounds(None));
        let mut renderer = Renderer::new(&context, case.scene.clone(), &case.pose, settings, options).expect("it fits");
        renderer.render(&case.pose, &case.view).expect("a frame").noise.expect("several passes")
    };
    let (one, sixteen) = (noise(1), noise(16));
    println!("noise {one:.4} of one path, {sixteen:.4} of sixteen");
    // All paths of a pixel and pass start at the same point of it, and estimates of noise have noise themselves.
    assert!((0.18..0.36).contains(&(sixteen / one)), "{sixteen} of {one}");
    gpu::assert_clean(&context);
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
