//! Rays and shadow rays through the tree of a frame, against brute force over all recorded triangles
//! (`rays_oracle/oracle.rs`).
//!
//! Every triangle lies within the grid. Rays end at its border; there is no statement about surfaces outside.

use crate::gpu;
use crate::studio::asset;
mod oracle;

use std::sync::Arc;
use std::time::Instant;

use crate::scenes::{Random, add, triangle};
use bytemuck::{Zeroable, bytes_of};
use glam::{Affine2, DAffine3, DVec2, DVec3, Vec2, Vec3, Vec4};
use oracle::{Facet, Found, Oracle, Ray, Tally};
use rayon::prelude::*;
use twobounce::ground::constants::{Features, constants};
use twobounce::renderer::Renderer;
use twobounce::scene::{Alpha, Material, Mesh, Mip, Scene, Texture, TextureImage, TextureRef, Wrap};
use twobounce::settings::{Bounces, Settings, Tracer};
use twobounce::vk::*;

/// A point on a facet, and the facet: the larger of two, so that needles are met more often than they are aimed at.
fn point_on<'a>(facets: &'a [Facet], random: &mut Random) -> (DVec3, &'a Facet) {
    let mut draw = || &facets[(random.unit() * facets.len() as f64) as usize];
    let area = |f: &Facet| f.edges[0].cross(f.edges[1]).length();
    let two = [draw(), draw()];
    let facet = if area(two[0]) > area(two[1]) { two[0] } else { two[1] };
    let uv = DVec2::new(random.unit(), random.unit());
    (facet.at(if uv.x + uv.y < 1.0 { uv } else { DVec2::ONE - uv }), facet)
}

/// Rays of every kind in turn.
fn rays(facets: &[Facet], edge: u32, count: usize) -> Vec<Ray> {
    let (mut random, size) = (Random::new(u64::from(edge)), f64::from(edge));
    let mut ray = |i: usize| {
        let r = &mut random;
        let anywhere = r.point() * size;
        let direction = r.direction();
        let (on, facet) = point_on(facets, r);
        let (other, _) = point_on(facets, r);
        let none = DVec3::ZERO;
        let distance = r.unit() * 1.5 * size;
        let (position, to, distance, facet) = match i % 8 {
            // From anywhere; every other one to a light at an infinite distance.
            0 => (anywhere, direction, if i.is_multiple_of(16) { 1e30 } else { distance }, none),
            // From a surface, to either side.
            1 => (on, direction, distance, facet.normal),
            // Along an axis; every other one in the planes between voxels.
            2 => {
                let axis = DVec3::AXES[i / 16 % 3] * if r.unit() < 0.5 { -1.0 } else { 1.0 };
                (if i % 16 == 2 { anywhere } else { anywhere.floor() }, axis, distance, none)
            }
            // From outside of the grid, to something in it or past it.
            3 => {
                let from = DVec3::splat(size / 2.0) + direction * size * (0.9 + r.unit());
                let to = if i % 16 == 3 { other } else { anywhere };
                (from, to - from, 1.5 * distance, none)
            }
            // Grazing a surface: nearly along it, from close to it.
            4 => {
                let tilt = facet.normal * 0.02 * (r.unit() - 0.5);
                let along = facet.normal.cross(direction).normalize() + tilt;
                (on + facet.normal * 0.1 * (r.unit() - 0.5), along, distance, none)
            }
            // Very short, from a surface.
            5 => (on, direction, 10f64.powf(-3.0 + 3.0 * r.unit()), facet.normal),
            // Ends right before a surface, or right behind it.
            6 => {
                let distance = (on - anywhere).length();
                (anywhere, on - anywhere, distance + 0.1 * (r.unit() - 0.5), none)
            }
            // From one surface to another, as to a point of a lamp.
            _ => (on, other - on, (other - on).length() - 0.01, facet.normal),
        };
        Ray {
            position: position.as_vec3().into(),
            least: if i.is_multiple_of(24) { 0.3 * distance.min(size) as f32 } else { 0.0 },
            d: to.normalize_or(DVec3::X).as_vec3().into(),
            distance: distance.max(0.0) as f32,
            facet: facet.as_vec3().into(),
        }
    };
    (0..count).map(&mut ray).collect()
}

fn trace(context: &Arc<Context>, renderer: &Renderer, settings: &Settings, shadow: bool, rays: &[Ray]) -> Vec<Found> {
    let mut constants = constants(settings, renderer.ground().desc.features);
    constants.push(("SHADOW", u32::from(shadow).into()));
    let desc = ComputeDesc { label: "rays", shader: "test/rays.comp", constants: &constants };
    let pipeline = Compute::new(context, &desc).expect("a pipeline");
    let inputs = upload(context, "inputs", rays).expect("an upload");
    let none = Found { passed: [f32::NAN; 3], ..Found::zeroed() };
    let outputs = upload(context, "outputs", &vec![none; rays.len()]).expect("an upload");
    let mut binds = renderer.ground().binds();
    binds.extend([Bind::buffer("inputs", &inputs), Bind::buffer("outputs", &outputs)]);
    let mut recorder = Recorder::new(context, RecorderOptions::default()).expect("a recorder");
    let count = rays.len() as u32;
    recorder.zone("rays", ZoneKind::Compute, 0, |r| {
        r.dispatch(&pipeline, &pipeline.select(&binds), &count, [count.div_ceil(64), 1, 1]);
    });
    recorder.finish().expect("a dispatch");
    let found = download(context, &outputs).expect("outputs");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    found
}

/// The nearest triangles and the shadows that rays find.
type Traced = [Vec<Found>; 2];

/// The largest share of rays for which queries find another hit than the tree: rays that meet an edge, where the tree
/// tests more triangles than a device proposes.
const MOST_APART: f64 = 5e-4;

/// Compares `count` rays over `scene` with brute force, by every tracer of the device. The tally is the tree's.
fn compare(scene: &Scene, settings: &Settings, count: usize, undecided: f64) -> Tally {
    let of = |tracer: &Tracer| {
        let mut settings = settings.clone();
        settings.of.rays.tracer = *tracer;
        compare_by(scene, &settings, count, undecided)
    };
    let mut of_all: Vec<(Tally, Traced)> = gpu::tracers(&gpu::context()).iter().map(of).collect();
    if let [(_, tree), (_, query)] = &of_all[..] {
        let apart = [0, 1].map(|k| tree[k].iter().zip(&query[k]).filter(|(a, b)| bytes_of(*a) != bytes_of(*b)).count());
        println!(
            "{}: of {count} rays {} find other bits than by the tree, of shadow rays {}",
            scene.name, apart[0], apart[1]
        );
        let most = (MOST_APART * count as f64) as usize;
        assert!(apart.iter().all(|&rays| rays <= most), "{}: {apart:?} of {count} rays are apart", scene.name);
    }
    of_all.swap_remove(0).0
}

fn compare_by(scene: &Scene, settings: &Settings, count: usize, undecided: f64) -> (Tally, Traced) {
    let (context, edge) = (gpu::context(), settings.voxels);
    let renderer = gpu::render(&context, scene, settings, 8);
    let tracer = settings.of.rays.tracer;
    assert_eq!(renderer.ground().desc.features.has(Features::QUERY), tracer == Tracer::Query);
    let oracle = Oracle::new(&context, &renderer);
    let rays = rays(&oracle.facets, edge, count);
    let start = Instant::now();
    let nearest = trace(&context, &renderer, settings, false, &rays);
    let shadows = trace(&context, &renderer, settings, true, &rays);
    let traced = start.elapsed();
    let tally = (0..count)
        .into_par_iter()
        .map(|i| oracle.check(&rays[i], &nearest[i], &shadows[i]))
        .reduce(Tally::default, Tally::and);
    let seconds = [traced, start.elapsed() - traced].map(|time| time.as_secs_f64());
    println!(
        "{} by {tracer}, {edge}³, {} triangles: {count} rays, {} hits ({} undecided); shadow rays {} open, {} blocked, {} between ({} \
         undecided); {:.1} s and {:.1} s of brute force",
        scene.name,
        oracle.facets.len(),
        tally.hits,
        tally.undecided_hits,
        tally.open,
        tally.blocked,
        tally.between,
        tally.undecided_shadows,
        seconds[0],
        seconds[1]
    );
    let wrong = &tally.wrong;
    let shown = wrong.iter().take(3).cloned().collect::<Vec<_>>().join("\n");
    assert!(
        wrong.is_empty(),
        "{} by {tracer}, {edge}³: {} of {count} rays are wrong:\n{shown}",
        scene.name,
        wrong.len()
    );
    assert!(tally.hits * 3 > count, "few rays hit anything");
    let most = (count as f64 * undecided) as usize;
    assert!(tally.undecided_hits <= most && tally.undecided_shadows <= most, "too many rays are undecided");
    (tally, [nearest, shadows])
}

fn voxels(edge: u32) -> Settings {
    Settings { voxels: edge, bounces: Bounces::One, ..Settings::fast() }
}

#[test]
fn rays_in_the_gallery() {
    let scene = asset("gallery.glb");
    // Fewer rays, because the scene has more triangles. More of them are undecided: small triangles are seen from far,
    // some twice.
    compare(&scene, &voxels(64), 20_000, 0.012);
}

/// A room of double-sided walls with a cloud of triangles: of every size, one- and two-sided, every fifth thin.
fn room() -> Scene {
    let (mut scene, mut random) = (Scene::empty("room"), Random::new(11));
    let both = |color: Vec3, double_sided: bool| Material { double_sided, ..Material::lambert("cloud", color) };
    let walls = scene.add_material(both(Vec3::splat(0.6), true));
    scene.add_mesh(Mesh::cuboid("walls", walls, Vec3::ZERO, Vec3::new(8.0, 6.0, 7.0), true), DAffine3::IDENTITY);
    for double_sided in [false, true] {
        let cloud: Vec<_> = (0..1000)
            .map(|i| {
                let center = DVec3::new(1.0, 1.0, 1.0) + random.point() * DVec3::new(6.0, 4.0, 5.0);
                let [a, b, c] = triangle(&mut random, center, 0.05 + random_size(i));
                if i % 5 == 0 { [a, b, b + (c - b) * 0.02] } else { [a, b, c] }
            })
            .collect();
        add(&mut scene, &cloud, both(random.point().as_vec3(), double_sided));
    }
    scene
}

/// Sizes by number, from small to large.
fn random_size(i: usize) -> f64 {
    1.2 * ((i * 7 % 100) as f64 / 100.0).powi(3)
}

#[test]
fn rays_in_a_cloud_of_triangles() {
    compare(&room(), &voxels(32), 100_000, 0.003);
    compare(&room(), &voxels(64), 100_000, 0.003);
}

/// Sheets with every way to transmit light: masks, blending, tinted transmission, by textures and by factors, one- and
/// two-sided, and a few opaque ones. Every fourth lies in an axis plane.
fn veils() -> Scene {
    let (mut scene, mut random) = (Scene::empty("veils"), Random::new(12));
    let texel = |k: usize, random: &mut Random| {
        // Red transmits, blue is metal; three in eight are holes for the masks.
        let alpha = if random.unit() < 0.375 { 0 } else { 100 + (random.unit() * 156.0) as u8 };
        let color = random.point() * 255.0;
        if k.is_multiple_of(4) { [255, 255, 0, alpha] } else { [color.x as u8, color.y as u8, color.z as u8, alpha] }
    };
    let rgba: Vec<u8> = (0..8 * 4).flat_map(|k| texel(k, &mut random)).collect();
    scene.images.push(TextureImage { name: "veil".into(), width: 8, height: 4, rgba });
    for (linear, wrap) in [(false, [Wrap::Repeat, Wrap::Mirror]), (true, [Wrap::Mirror, Wrap::Clamp])] {
        scene.textures.push(Texture { image: 0, wrap, mag_linear: linear, min_linear: linear, mip: Mip::None });
    }
    let transform = Affine2::from_scale_angle_translation(Vec2::new(1.7, 0.9), 0.3, Vec2::new(0.2, -0.4));
    let by = |texture: usize| Some(TextureRef { texture, uv_set: 0, transform });
    let tint = || Material { base_color: Vec4::new(0.9, 0.6, 0.3, 0.8), ..Material::lambert("veil", Vec3::ONE) };
    let glass = |transmission: f32| Material { transmission, ..tint() };
    let kinds = [
        Material { alpha: Alpha::Mask(0.37), base_color_texture: by(0), ..tint() },
        Material { alpha: Alpha::Mask(0.2), base_color_texture: by(1), ..tint() },
        Material { alpha: Alpha::Mask(0.5), base_color_texture: by(0), ..glass(0.7) },
        Material { alpha: Alpha::Blend, ..tint() },
        Material { alpha: Alpha::Blend, base_color_texture: by(1), ..tint() },
        Material { alpha: Alpha::Blend, base_color_texture: by(0), ..glass(0.5) },
        glass(1.0),
        Material { transmission_texture: by(1), ..glass(0.9) },
        Material { metallic: 0.8, metallic_roughness_texture: by(0), ..glass(1.0) },
        Material { base_color_texture: by(1), transmission_texture: by(0), ..glass(1.0) },
        tint(),
    ];
    for (kind, material) in kinds.into_iter().enumerate() {
        for double_sided in [false, true] {
            let opaque = kind == 10;
            let index = scene.add_material(Material { double_sided, ..material.clone() });
            for i in 0..if opaque { 4 } else { 12 } {
                let (mut u, mut v) = (random.direction(), random.direction());
                if i % 4 == 0 {
                    (u, v) = (DVec3::AXES[(kind + i / 4) % 3], DVec3::AXES[(kind + i / 4 + 1) % 3]);
                }
                let [u, v] = [u, v].map(|e| (e * (0.8 + 1.5 * random.unit())).as_vec3());
                let corner = (random.point() * 6.0).as_vec3() - (u + v) / 2.0;
                scene.add_mesh(Mesh::quad("veil", index, corner, u, v), DAffine3::IDENTITY);
            }
        }
    }
    scene
}

#[test]
fn rays_through_masks_blending_and_glass() {
    // A GPU's filter leaves more open, at the edges of texels.
    let undecided = if gpu::context().is_cpu { 0.003 } else { 0.03 };
    let tally = compare(&veils(), &voxels(32), 100_000, undecided);
    assert!(tally.open > 10_000 && tally.blocked > 10_000 && tally.between > 10_000, "{tally:?}");
}

/// Slivers and needles across the grid, every other one transmitting, and one large triangle that crosses everything.
fn slivers() -> Scene {
    let (mut scene, mut random) = (Scene::empty("slivers"), Random::new(13));
    let veil = Material { alpha: Alpha::Blend, base_color: Vec4::new(0.5, 0.5, 0.5, 0.25), ..Material::default() };
    for material in [Material { double_sided: true, ..Material::lambert("sliver", Vec3::ONE) }, veil] {
        let slivers: Vec<_> = (0..750)
            .map(|i| {
                let [a, b] = [random.point(), random.point()].map(|p| 8.0 * p);
                // Needles are 0.004 voxels wide at most.
                let width = if i % 15 == 0 { 1e-3 } else { 0.25 };
                [a, b, (b + width * random.direction()).clamp(DVec3::ZERO, DVec3::splat(8.0))]
            })
            .collect();
        add(&mut scene, &slivers, material);
    }
    let large = [DVec3::new(0.1, 0.3, 7.9), DVec3::new(7.8, 7.6, 0.2), DVec3::new(0.4, 7.7, 3.1)];
    add(&mut scene, &[large], Material::lambert("large", Vec3::ONE));
    scene
}

#[test]
fn rays_between_slivers_and_needles() {
    // Rounding of a needle's determinant is as large as the needle's width.
    compare(&slivers(), &voxels(32), 100_000, 0.02);
}
