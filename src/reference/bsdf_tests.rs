//! Sampling against evaluation, for every lobe that a material may have.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::bsdf::{Bsdf, Viewing};
use super::sampler::Sampler;
use crate::scene::finish::FinishParams;
use crate::scene::surface::SurfaceParams;

fn plain() -> FinishParams {
    FinishParams {
        clearcoat: 0.0,
        clearcoat_roughness: 0.3,
        clearcoat_normal_tangent: Vec3::Z,
        sheen_color: Vec3::ZERO,
        sheen_roughness: 0.4,
        anisotropy: 0.0,
        anisotropy_direction: Vec2::X,
        iridescence: 0.0,
        film_ior: 1.4,
        film_nm: 450.0,
        diffuse_transmission: 0.0,
        diffuse_transmission_color: Vec3::new(0.9, 0.5, 0.2),
        dispersion: 0.0,
    }
}

fn params(finish: FinishParams, metallic: f32, transmission: f32) -> SurfaceParams {
    let base_color = Vec3::new(0.8, 0.6, 0.3);
    SurfaceParams {
        base_color,
        opacity: 1.0,
        metallic,
        roughness: 0.5,
        emissive: Vec3::ZERO,
        diffuse: base_color * (1.0 - metallic),
        f0: Vec3::splat(0.04).lerp(base_color, metallic),
        f90: 1.0,
        transmission: transmission * (1.0 - metallic),
        ior: 1.5,
        absorption: Vec3::ZERO,
        normal_tangent: Vec3::Z,
        unlit: false,
        finish: Some(finish),
    }
}

/// (name, BSDF) of every lobe alone and of all at once, seen from two directions.
fn cases() -> Vec<(String, Bsdf)> {
    let white = Vec3::new(0.9, 0.7, 0.5);
    let materials = [
        ("clearcoat", params(FinishParams { clearcoat: 0.9, ..plain() }, 0.0, 0.0)),
        ("sheen", params(FinishParams { sheen_color: white, ..plain() }, 0.0, 0.0)),
        ("anisotropy", params(FinishParams { anisotropy: 0.7, ..plain() }, 1.0, 0.0)),
        ("iridescence", params(FinishParams { iridescence: 1.0, ..plain() }, 0.3, 0.0)),
        ("diffuse transmission", params(FinishParams { diffuse_transmission: 0.6, ..plain() }, 0.0, 0.0)),
        ("both transmissions", params(FinishParams { diffuse_transmission: 0.6, ..plain() }, 0.0, 0.4)),
        (
            "all",
            params(
                FinishParams {
                    clearcoat: 0.7,
                    sheen_color: white * 0.6,
                    anisotropy: 0.5,
                    iridescence: 0.8,
                    diffuse_transmission: 0.5,
                    ..plain()
                },
                0.2,
                0.3,
            ),
        ),
    ];
    let mut cases = Vec::new();
    for (name, params) in materials {
        for (tilt, volume) in [(0.4f32, false), (1.2, false), (0.7, true)] {
            let viewing = Viewing {
                normal: Vec3::Z,
                coat_normal: Vec3::new(0.1, 0.05, 1.0).normalize(),
                geometric: Vec3::Z,
                grain: Vec3::new(1.0, 0.5, 0.0),
                wo: Vec3::new(tilt.sin() * 0.8, tilt.sin() * 0.6, tilt.cos()),
                inside: false,
            };
            cases.push((format!("{name} at {tilt}, volume {volume}"), Bsdf::new(&params, volume, viewing)));
        }
    }
    cases
}

const BINS: usize = 4;

/// The bin of a unit direction, by height and azimuth.
fn bin(d: Vec3) -> usize {
    let z = ((d.z * 0.5 + 0.5) * BINS as f32).min(BINS as f32 - 1.0) as usize;
    let turn = ((d.y.atan2(d.x) / TAU + 0.5) * BINS as f32).min(BINS as f32 - 1.0) as usize;
    z * BINS + turn
}

/// f and density, integrated over a fine grid of the sphere: the totals, and the density per bin.
fn integrals(bsdf: &Bsdf) -> (Vec3, [f32; BINS * BINS]) {
    const N: usize = 1024;
    let (mut sum, mut bins) = (glam::DVec3::ZERO, [0.0f64; BINS * BINS]);
    let area = 2.0 * TAU as f64 / (N * N) as f64;
    for i in 0..N {
        let z = 2.0 * (i as f32 + 0.5) / N as f32 - 1.0;
        let r = (1.0 - z * z).sqrt();
        for k in 0..N {
            let (sin, cos) = (TAU * (k as f32 + 0.5) / N as f32).sin_cos();
            let d = Vec3::new(r * cos, r * sin, z);
            let (f, density) = bsdf.eval(d);
            sum += f.as_dvec3() * area;
            bins[bin(d)] += density as f64 * area;
        }
    }
    (sum.as_vec3(), bins.map(|x| x as f32))
}

/// Samples are distributed by the density, and the mean of their weights is the integral of f · cos.
#[test]
fn sampling_and_evaluation_agree() {
    const SAMPLES: u32 = 1 << 17;
    for (name, bsdf) in cases() {
        let (expected, density) = integrals(&bsdf);
        let (mut sum, mut share) = (glam::DVec3::ZERO, [0.0f32; BINS * BINS]);
        for i in 0..SAMPLES {
            let [lobe, u, v, _] = Sampler::new(3, 1, 2, i).set(1);
            if let Some(scatter) = bsdf.sample(lobe, [u, v]) {
                assert!(!scatter.mirror, "{name}");
                let (f, density) = bsdf.eval(scatter.direction);
                // The direction is rounded by the transforms to the world and back.
                assert!((scatter.density / density - 1.0).abs() < 1e-3, "{name}: {} {density}", scatter.density);
                assert!((scatter.weight * density - f).abs().max_element() <= 1e-3 * f.max_element(), "{name}");
                sum += scatter.weight.as_dvec3() / SAMPLES as f64;
                share[bin(scatter.direction)] += 1.0 / SAMPLES as f32;
            }
        }
        let sum = sum.as_vec3();
        // The tolerance covers noise of stratified samples, and the grid's resolution of lobes 10° wide.
        assert!((sum / expected - 1.0).abs().max_element() < 0.01, "{name}: {sum}, expected {expected}");
        for (at, (share, density)) in share.iter().zip(density).enumerate() {
            assert!((share - density).abs() < 0.005, "{name}, bin {at}: {share}, density {density}");
        }
    }
}

/// No more light leaves than arrives, from any direction.
#[test]
fn energy_is_kept() {
    for (name, bsdf) in cases() {
        let (all, _) = integrals(&bsdf);
        assert!(all.max_element() <= 1.0 && all.min_element() > 0.05, "{name}: {all}");
    }
}
