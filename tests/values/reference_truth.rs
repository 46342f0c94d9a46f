//! The reference against images of an independent renderer (`truth/README.md`).

use crate::traced;

use std::path::Path;

use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::compare;
use twobounce::measure::terms::Subtract;
use twobounce::reference::film::Film;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::{LoadOptions, Scene};

const SIZE: u32 = 64;

/// Noise of the truth images at this size (see their README).
const TRUTH_NOISE: f64 = 0.003;

fn path(scene: &str, file: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/truth").join(scene).join(file)
}

fn film(scene: &str, depth: Depth, samples: u32) -> Film {
    seeded(scene, depth, samples, 0)
}

fn seeded(scene: &str, depth: Depth, samples: u32, seed: u64) -> Film {
    let scene = Scene::load(&path(scene, &format!("{scene}.glb")), &LoadOptions::default()).expect("the scene loads");
    let pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    let stop = Stop::Samples(samples);
    let options = Options { width: SIZE, height: SIZE, depth, stop, seed, occlusion: false };
    traced::film(&scene, &view, &options)
}

fn agrees(scene: &str, file: &str, depth: Depth) {
    let film = film(scene, depth, 128);
    let (truth, _) = Layers::read_exr(&path(scene, file)).expect("the truth can be read");
    let metrics = compare(&film.layers(&[]), &truth, Subtract::Own).expect("the images can be compared").total;
    let noise = film.noise() + TRUTH_NOISE;
    let told = format!("{scene} {file}: {metrics:?}, noise {noise:.4}");
    println!("{told}");
    // The tolerance covers the noise of both means.
    assert!((metrics.energy - 1.0).abs() < 0.005, "{told}");
    // `rel` is smaller than the root mean square error. The additional 2 % cover the truth's smoothing at edges.
    assert!(metrics.rel < 0.02 + noise, "{told}");
}

#[test]
fn direct_light_of_a_lamp() {
    agrees("cornell-area", "direct.exr", Depth::Bounces(0));
}

#[test]
fn one_bounce_of_a_lamp() {
    agrees("cornell-area", "depth3.exr", Depth::Bounces(1));
}

#[test]
fn two_bounces_of_a_lamp() {
    agrees("cornell-area", "depth4.exr", Depth::Bounces(2));
}

#[test]
fn full_light_of_a_lamp() {
    agrees("cornell-area", "total.exr", Depth::Full);
}

#[test]
fn direct_light_of_a_point() {
    agrees("cornell-point", "direct.exr", Depth::Bounces(0));
}

#[test]
fn one_bounce_of_a_point() {
    agrees("cornell-point", "depth3.exr", Depth::Bounces(1));
}

#[test]
fn two_bounces_of_a_point() {
    agrees("cornell-point", "depth4.exr", Depth::Bounces(2));
}

#[test]
fn full_light_of_a_point() {
    agrees("cornell-point", "total.exr", Depth::Full);
}

/// Films of other seeds: their spread is a pixel's variance.
const BATCHES: u64 = 16;
const BATCH_SAMPLES: u32 = 16;
/// Of 4,096 pixels a Student's t of 15 degrees of freedom leaves one beyond this in a hundred images: 0.01/4096 on both
/// sides.
const FAR: f64 = 7.0;
/// Share of the pixels that must lie within [`FAR`].
const SHARE: f64 = 0.9975;
/// The most standard deviations of the mean z of all pixels: the truth's means are good to 0.1 %, which is up to 4
/// here.
const MEAN_FAR: f64 = 8.0;

/// Share of the pixels within [`FAR`], and the sum of z over √pixels.
fn z_test(batches: &[Vec<f64>], truth: &[f64]) -> (f64, f64) {
    let count = batches.len() as f64;
    // Uncertainty of the truth itself, and half-float rounding in dark pixels.
    let floor = 1e-3 * truth.iter().sum::<f64>() / truth.len() as f64;
    let z: Vec<f64> = (0..truth.len())
        .map(|i| {
            let mean = batches.iter().map(|batch| batch[i]).sum::<f64>() / count;
            let variance = batches.iter().map(|batch| (batch[i] - mean).powi(2)).sum::<f64>() / (count - 1.0) / count;
            (mean - truth[i]) / (variance + (TRUTH_NOISE * truth[i]).powi(2) + floor * floor).sqrt()
        })
        .collect();
    let within = z.iter().filter(|z| z.abs() <= FAR).count() as f64 / z.len() as f64;
    (within, z.iter().sum::<f64>() / (z.len() as f64).sqrt())
}

/// Each pixel's error in its own standard deviations. Direct light: the truth's indirect light is smoothed.
#[test]
fn pixels_err_as_their_variance_says() {
    for scene in ["cornell-area", "cornell-point"] {
        let sums = |pixels: &[[f32; 3]]| -> Vec<f64> {
            pixels.iter().map(|p| p.iter().map(|v| f64::from(*v)).sum()).collect()
        };
        let (truth, _) = Layers::read_exr(&path(scene, "direct.exr")).expect("the truth can be read");
        let truth = sums(truth.beauty());
        let batch = |seed| sums(seeded(scene, Depth::Bounces(0), BATCH_SAMPLES, seed).layers(&[]).beauty());
        let batches: Vec<Vec<f64>> = (1..=BATCHES).map(batch).collect();
        let (within, mean) = z_test(&batches, &truth);
        println!("{scene}: {:.3} % of the pixels, mean {mean:.2}", 100.0 * within);
        assert!(within >= SHARE, "{scene}: {within}");
        assert!(mean.abs() <= MEAN_FAR, "{scene}: {mean}");
        let biased: Vec<Vec<f64>> = batches.iter().map(|batch| batch.iter().map(|v| 1.01 * v).collect()).collect();
        let (_, planted) = z_test(&biased, &truth);
        assert!(planted > MEAN_FAR, "{scene}: a bias of 1 % is not seen: {planted}");
    }
}

/// Albedo ½ and emission 1: n bounces give Σ ½ᵏ, k = 0…n + 1, unlimited bounces 2.
#[test]
fn furnace() {
    for (depth, expected) in
        [(Depth::Bounces(0), 1.5), (Depth::Bounces(1), 1.75), (Depth::Bounces(2), 1.875), (Depth::Full, 2.0)]
    {
        let film = film("furnace-05", depth, 16);
        let layers = film.layers(&[Aov::Direct]);
        let mean = |aov| layers.get(aov).map(|p| p.iter().flatten().sum::<f32>() / (3 * SIZE * SIZE) as f32);
        let (beauty, direct) = (mean(Aov::Beauty).expect("there"), mean(Aov::Direct).expect("there"));
        // Five standard deviations of the mean of 4,096 pixels with the noise that the film states.
        let tolerance = 5.0 * film.noise() as f32 * expected / SIZE as f32 + 1e-5;
        assert!((beauty - expected).abs() < tolerance, "{depth:?}: {beauty}, expected {expected} ± {tolerance}");
        assert!((direct - 1.5).abs() < tolerance, "{depth:?}: direct {direct}");
    }
}
