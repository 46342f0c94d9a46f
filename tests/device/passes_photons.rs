//! The passes of the method `photons` against counts and sums on the CPU: coverage by samples, the light of a voxel's
//! photons, mips.

use crate::gpu;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::scenes::{Random, add, triangle};
use glam::{DVec3, UVec3, Vec3, Vec4};
use gpu::twins::cover::{counts, dominant_axis};
use gpu::twins::octahedron;
use gpu::twins::volume::texel_index;
use gpu::twins::voxelise::Polygon;
use half::f16;
use twobounce::ground::layout::{Globals, ItemLight, ItemPart, ListItem, Triangle};
use twobounce::ground::voxelise::samples_per_pixel as samples;
use twobounce::renderer::Renderer;
use twobounce::scene::LightKind;
use twobounce::scene::{Material, Scene};
use twobounce::settings::{Bounces, Center, Settings};
use twobounce::vk::{Context, Image, ShaderStage, download, download_image};

const EDGE: u32 = 16;
const TEXELS: usize = 16;

fn settings(changes: &[&str]) -> Settings {
    let mut settings = Settings { voxels: EDGE, bounces: Bounces::One, ..Settings::photons() };
    settings.lights.lamps = twobounce::settings::LampLight::Gathered;
    settings.grid.center = Center::Point([f64::from(EDGE) / 2.0; 3]);
    settings.grid.side = Some(f64::from(EDGE));
    gpu::with(settings, changes)
}

/// Triangles about three voxels large that emit on one side, each with a colour of its own.
fn confetti() -> Scene {
    let (mut scene, mut random) = (Scene::empty("confetti"), Random::new(3));
    for _ in 0..60 {
        let center = random.point() * 12.0 + 2.0;
        let corners = triangle(&mut random, center, 4.0);
        add(&mut scene, &[corners], Material::lamp("lamp", random.point().as_vec3() + 0.1));
    }
    scene
}

/// A square across the grid at x = 5.5 that sends 2 towards −x.
fn wall() -> Scene {
    let mut scene = Scene::empty("wall");
    let at = |y: f64, z: f64| DVec3::new(5.5, y, z);
    let e = f64::from(EDGE);
    let halves = [[at(0.0, 0.0), at(0.0, e), at(e, e)], [at(0.0, 0.0), at(e, e), at(e, 0.0)]];
    add(&mut scene, &halves, Material::lamp("lamp", Vec3::splat(2.0)));
    scene
}

/// An item of the lists on the device.
struct Item {
    triangle: u32,
    voxel: u32,
    corners: [DVec3; 3],
    samples: u32,
    light: ItemLight,
}

fn items(context: &Arc<Context>, renderer: &Renderer) -> Vec<Item> {
    let (ground, lists) = (renderer.ground(), renderer.ground().base());
    let globals: Globals = download(context, &lists.globals).expect("counters")[0];
    let entries: Vec<ListItem> = download(context, &lists.items).expect("items");
    let counted: Vec<u32> = download(context, &lists.item_samples).expect("samples");
    let parts: Vec<ItemPart> = download(context, &lists.item_parts).expect("parts");
    let lights: Vec<ItemLight> = download(context, &lists.item_lights).expect("lights");
    let triangles: Vec<Triangle> = download(context, &ground.triangles).expect("triangles");
    let item = |i: usize| {
        let entry = entries[i];
        let corners = triangles[entry.triangle as usize].corners;
        Item {
            triangle: entry.triangle,
            voxel: entry.voxel,
            corners: corners.map(|v| Vec3::from_array(v).as_dvec3()),
            samples: counted[i],
            light: lights[parts[i].lit_by as usize],
        }
    };
    (0..globals.item_count as usize).map(item).collect()
}

/// A level of an image of the method; of the map, all of its blocks.
fn level(context: &Arc<Context>, image: &Image, k: u32) -> Vec<Vec4> {
    let texels: Vec<[u16; 4]> = download_image(context, image, k).expect("a level");
    texels.iter().map(|t| Vec4::from_array(t.map(|b| f16::from_bits(b).to_f32()))).collect()
}

/// The sixteen directions of a voxel in a level of the map.
fn directions(map: &[Vec4], at: UVec3, edge: u32) -> [Vec4; TEXELS] {
    std::array::from_fn(|t| {
        let [x, y] = [at.x + edge * (t as u32 % 4), at.y + edge * (t as u32 / 4)];
        map[((at.z * 4 * edge + y) * 4 * edge + x) as usize]
    })
}

fn voxel_at(index: u32) -> UVec3 {
    UVec3::new(index % EDGE, index / EDGE % EDGE, index / (EDGE * EDGE))
}

const VOXELISE: [&str; 2] = ["photons.voxelise=samples", "photons.voxelise=conservative"];

#[test]
fn every_item_counts_its_samples() {
    let context = gpu::context();
    for (wanted, voxelise) in [(1, VOXELISE[0]), (1, VOXELISE[1]), (8, VOXELISE[0]), (8, VOXELISE[1])] {
        let per_pixel = samples(&context, wanted).expect("standard places");
        let setting = format!("photons.samples={wanted}");
        let renderer = gpu::render(&context, &confetti(), &settings(&[&setting, voxelise]), 16);
        let items = items(&context, &renderer);
        let (mut counted, mut sure, mut expected) = (0, 0, BTreeMap::new());
        for item in &items {
            let of_triangle = expected.entry(item.triangle).or_insert_with(|| counts(item.corners, per_pixel, EDGE));
            // A pair that is missing or listed twice has no count. Between the two bounds: within the rasteriser's
            // snapping.
            let [least, most] = of_triangle.remove(&item.voxel).unwrap_or_default();
            assert!((least..=most).contains(&item.samples), "{} samples, not {least} to {most}", item.samples);
            // Lists made from samples hold nothing else.
            assert!(item.samples > 0 || voxelise == VOXELISE[1], "an item without samples");
            counted += item.samples;
            sure += least;
        }
        // The lists have every voxel that certainly has samples.
        assert!(expected.values().flatten().all(|(_, count)| count[0] == 0), "a sample found no list");
        assert!(counted > 100 * per_pixel && f64::from(sure) > 0.9 * f64::from(counted), "{counted}, {sure} sure");
    }
}

/// Samples alone list the pairs of the conservative lists that samples reach, by one pass without a geometry shader.
#[test]
fn lists_made_of_samples_are_the_conservative_ones_that_samples_reach() {
    let context = gpu::context();
    let per_pixel = samples(&context, 8).expect("standard places");
    let scene = confetti();
    let [sampled, conservative] = VOXELISE.map(|voxelise| gpu::render(&context, &scene, &settings(&[voxelise]), 16));
    let stages = |renderer: &Renderer, zone: &str| -> Vec<Vec<ShaderStage>> {
        let log = renderer.log().expect("the log is kept");
        let draws = log.zones_named(zone).flat_map(|zone| zone.draws().collect::<Vec<_>>());
        draws.map(|draw| draw.stages.iter().map(|s| s.stage).collect()).collect()
    };
    assert_eq!(stages(&sampled, "voxelise"), [[ShaderStage::Vertex, ShaderStage::Fragment]]);
    assert!(stages(&sampled, "cover").is_empty());
    assert!(stages(&conservative, "voxelise").is_empty(), "a compute pass lists them");
    assert_eq!(stages(&conservative, "cover"), [[ShaderStage::Vertex, ShaderStage::Fragment]]);
    // The device chooses the order of triangles.
    let pairs = |renderer: &Renderer| -> BTreeMap<(u32, [u64; 9]), Item> {
        let key = |item: &Item| (item.voxel, std::array::from_fn(|i| item.corners[i / 3][i % 3].to_bits()));
        items(&context, renderer).into_iter().map(|item| (key(&item), item)).collect()
    };
    let [found, listed] = [&sampled, &conservative].map(pairs);
    let (mut unreached, mut lights) = (0, BTreeSet::new());
    for (pair, item) in &listed {
        unreached += usize::from(item.samples == 0);
        assert_eq!(found.get(pair).map_or(0, |found| found.samples), item.samples, "of {}", item.voxel);
        if let Some(other) = found.get(pair) {
            let [light, other] = [item, other].map(|item| bytemuck::bytes_of(&item.light));
            assert_eq!(light, other, "{:?}", item.light);
            lights.insert(item.light.front.map(f32::to_bits));
        }
    }
    // Beyond these bounds the rasteriser's snapping may move samples into a voxel that the triangle does not touch.
    for (pair, item) in found.iter().filter(|(pair, _)| !listed.contains_key(*pair)) {
        let [least, most] = counts(item.corners, per_pixel, EDGE)[&pair.0];
        assert!(least == 0 && item.samples <= most, "a voxel with {} samples is in no list", item.samples);
    }
    println!("{} pairs, {} of them without a sample; {} by samples", listed.len(), unreached, found.len());
    assert!(
        unreached > 100 && found.len() > 200 && lights.len() > 50,
        "{unreached}, {}, {}",
        found.len(),
        lights.len()
    );
}

/// Benefit of more samples: mean error of an item's area over the mean area.
#[test]
fn more_samples_measure_areas_better() {
    let context = gpu::context();
    let renderer = gpu::render(&context, &confetti(), &settings(&[VOXELISE[1]]), 16);
    let items = items(&context, &renderer);
    let error = |per_pixel: u32| {
        let (mut error, mut total) = (0.0, 0.0);
        for item in &items {
            let normal = (item.corners[1] - item.corners[0]).cross(item.corners[2] - item.corners[0]).normalize();
            let low = voxel_at(item.voxel).as_dvec3();
            let exact = Polygon::clipped(&item.corners, low, low + 1.0).area_vector().length();
            let [least, most] = counts(item.corners, per_pixel, EDGE).get(&item.voxel).copied().unwrap_or_default();
            let share = f64::from(least + most) / 2.0 / f64::from(per_pixel);
            error += (share / normal.abs()[dominant_axis(normal)] - exact).abs();
            total += exact;
        }
        error / total
    };
    let [one, four, eight] = [1, 4, 8].map(error);
    println!("error of an item's area: {one:.3} by one sample, {four:.3} by four, {eight:.3} by eight");
    // Samples spread over a pixel halve the error with every four times as many, or a little better.
    assert!(four < 0.55 * one && eight < 0.75 * four && eight > 0.1 * four, "{one} {four} {eight}");
}

#[test]
fn a_voxel_sends_what_its_photons_do() {
    let context = gpu::context();
    let renderer = gpu::render(&context, &confetti(), &settings(&[]), 16);
    let per_pixel = samples(&context, 8).expect("standard places") as f32;
    let images = renderer.frame().method.images();
    let [map, forth, back] = [0, 1, 2].map(|k| level(&context, images[k], 0));
    #[derive(Default)]
    struct Sum {
        exitance: Vec3,
        forth: Vec3,
        back: Vec3,
        share: f32,
    }
    let mut sums: BTreeMap<u32, Sum> = BTreeMap::new();
    for item in items(&context, &renderer) {
        let n = (item.corners[1] - item.corners[0]).cross(item.corners[2] - item.corners[0]).normalize();
        let share = item.samples as f32 / per_pixel;
        let area = share / n.abs()[dominant_axis(n)] as f32;
        let facing = area * n.abs().as_vec3();
        let meets_forth = Vec3::from_array(n.to_array().map(|v| f32::from(u8::from(v < 0.0))));
        let sum = sums.entry(item.voxel).or_default();
        // Lambertian: exitance is π times radiance. Dark backs are left out.
        sum.exitance += std::f32::consts::PI * area * Vec3::from_array(item.light.front);
        sum.forth += facing * meets_forth;
        sum.back += facing * (1.0 - meets_forth);
        sum.share += share;
    }
    let mut uncut = 0;
    for (voxel, sum) in sums {
        let at = voxel_at(voxel);
        let index = texel_index(at, EDGE);
        // Half a unit of an f16.
        let near = |got: Vec3, right: Vec3| (got - right).abs().max_element() <= right.max_element() / 1024.0 + 1e-6;
        let (forth, back) = (forth[index], back[index]);
        assert!(
            near(forth.truncate(), sum.forth.min(Vec3::ONE)) && near(back.truncate(), sum.back.min(Vec3::ONE)),
            "{at}"
        );
        assert!((forth.w - sum.share.min(1.0)).abs() < 1e-3, "{at}: {forth} is not {}", sum.share);
        let texels = directions(&map, at, EDGE);
        // Light of an overfilled voxel is clamped: such voxels are left out.
        if texels.iter().all(|t| t.w < 0.999) {
            let angles = (0..TEXELS).map(|t| octahedron::texel(t, DVec3::X).1 as f32);
            let sent: Vec3 = texels.iter().zip(angles).map(|(t, angle)| t.truncate() * angle).sum();
            // Sixteen roundings to f16.
            let near = (sent - sum.exitance).abs().max_element() <= 2e-3 * sum.exitance.max_element();
            assert!(near, "{at}: {sent} is not {}", sum.exitance);
            uncut += usize::from(sum.share > 0.0);
        }
    }
    assert!(uncut > 200, "{uncut} voxels are a test of little");
}

/// A slanting sheet of metal in sunlight: its voxels send as much as the same sheet sends evenly in another method, and
/// nowhere more than in the mirror direction.
#[test]
fn a_glossy_voxel_sends_its_lobe_whole_and_where_it_is_mirrored() {
    let context = gpu::context();
    let normal = DVec3::new(0.35, 0.8, -0.3).normalize();
    let travel = DVec3::new(0.5, -0.7, 0.2).normalize();
    let (u, v) = normal.any_orthonormal_pair();
    let middle = DVec3::splat(8.3);
    let at = |a: f64, b: f64| middle + 5.0 * (a * u + b * v);
    let corners = [[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0)], [at(-1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]];
    for (roughness, least) in [(0.3, 0.3), (0.7, 0.28)] {
        let mut scene = Scene::empty("sheet");
        let metal = Material { metallic: 1.0, roughness, ..Material::lambert("metal", Vec3::new(0.9, 0.5, 0.2)) };
        add(&mut scene, &corners, metal);
        let turn = glam::DQuat::from_rotation_arc(DVec3::NEG_Z, travel);
        scene.add_light(LightKind::Directional, Vec3::splat(3.0), glam::DAffine3::from_quat(turn));
        let even =
            gpu::render(&context, &scene, &Settings { method: twobounce::gi::Method::Cones, ..settings(&[]) }, 16);
        let lists = even.ground().base();
        let count = download::<Globals>(&context, &lists.globals).expect("counters")[0].item_count as usize;
        let lights: Vec<ItemLight> = download(&context, &lists.item_lights).expect("lights");
        let lights = &lights[..count];
        let lit =
            lights.iter().fold([0.0f32; 3], |most, light| if light.front[0] > most[0] { light.front } else { most });
        assert!(lit[0] > 0.0, "the sun shines on its front");
        let renderer = gpu::render(&context, &scene, &settings(&[]), 16);
        let map = level(&context, renderer.frame().method.images()[0], 0);
        let per_pixel = samples(&context, 8).expect("standard places") as f32;
        let area: f32 = items(&context, &renderer).iter().map(|item| item.samples as f32 / per_pixel).sum();
        let area = area / normal.abs().max_element() as f32;
        let mut sent = [Vec3::ZERO; TEXELS];
        for voxel in 0..EDGE.pow(3) {
            for (t, texel) in directions(&map, voxel_at(voxel), EDGE).into_iter().enumerate() {
                sent[t] += texel.truncate() * octahedron::texel(t, DVec3::X).1 as f32;
            }
        }
        let whole: Vec3 = sent.iter().sum();
        let expected =
            std::f32::consts::PI * area * Vec3::from_array(lit) * renderer.frame().scale / even.frame().scale;
        // Roundings to f16: of the lobe, and of its directions.
        assert!((whole / expected - 1.0).abs().max_element() < 4e-3, "{roughness}: {whole} is not {expected}");
        let mirrored = octahedron::place(travel - 2.0 * travel.dot(normal) * normal).floor();
        let there = sent[mirrored.x as usize + 4 * mirrored.y as usize].x;
        assert!(sent.iter().all(|texel| texel.x <= there), "{roughness}: {sent:?}, mirrored at {mirrored}");
        // A uniform light sends at most cos · Ω / π of the total to a texel, 0.28.
        assert!(there > least * whole.x, "{roughness}: {there} of {whole}");
    }
}

/// A plane is as opaque and as bright at every level, in both forms.
#[test]
fn a_plane_keeps_its_opacity_and_its_light_in_mips() {
    let context = gpu::context();
    for form in ["right", "printed"] {
        let setting = format!("photons.ledger.mips={form}");
        let renderer = gpu::render(&context, &wall(), &settings(&[&setting]), 16);
        let scale = renderer.frame().scale;
        let images = renderer.frame().method.images();
        for k in 0..=EDGE.ilog2() {
            let edge = EDGE >> k;
            let [map, forth, back] = [0, 1, 2].map(|i| level(&context, images[i], k));
            for (y, z) in (0..edge).flat_map(|y| (0..edge).map(move |z| (y, z))) {
                let at = UVec3::new(5 >> k, y, z);
                let index = texel_index(at, edge);
                // Seen from one side alone. Rounding of f16.
                let one_sided = [forth[index].x, back[index].x].map(|a| (a - 1.0).abs() < 2e-3 || a == 0.0);
                assert!(one_sided == [true; 2] && forth[index].x + back[index].x > 0.0, "{form}, level {k}, {at}");
                let texels = directions(&map, at, edge);
                let facing: Vec<&Vec4> = texels.iter().filter(|t| t.w > 0.0).collect();
                assert!(facing.len() == 8 || facing.len() == 12, "{} directions face it", facing.len());
                for t in facing {
                    assert!((t.x / t.w / (2.0 * scale) - 1.0).abs() < 4e-3, "{form}, level {k}, {at}: {t}");
                }
            }
        }
    }
}

/// As printed: Σ photons · v²/D², with the base voxel's edge v and a diameter D of each level's edge. A plane gives the
/// light that it sends, at every level; in general a level holds the sum of all photons below it, on their own face.
#[test]
fn printed_mips_sum_photons_up_and_a_plane_gives_one_at_every_level() {
    let context = gpu::context();
    let printed = || {
        let mut printed = settings(&[]);
        printed.of.photons = twobounce::gi::photons::Settings::printed();
        printed
    };
    for (name, scene) in [("wall", wall()), ("confetti", confetti())] {
        let renderer = gpu::render(&context, &scene, &printed(), 16);
        let scale = renderer.frame().scale;
        let images = renderer.frame().method.images();
        let base = [0, 1].map(|i| level(&context, images[i], 0));
        let (mut summed, mut most) = (0, 0.0_f32);
        for k in 0..=EDGE.ilog2() {
            let (edge, diameter) = (EDGE >> k, (1 << k) as f32);
            let [map, forth] = [0, 1].map(|i| level(&context, images[i], k));
            for at in (0..edge.pow(3)).map(|i| UVec3::new(i % edge, i / edge % edge, i / (edge * edge))) {
                let below = || (0..1u32 << (3 * k)).map(|i| (at << k) + UVec3::new(i, i >> k, i >> (2 * k)) % (1 << k));
                let opacity: f32 = below().map(|at| base[1][texel_index(at, EDGE)].w).sum();
                let share = forth[texel_index(at, edge)].w;
                // A rounding to f16 for each level.
                let near = |found: f32, exact: f32| (found - exact).abs() <= (k + 1) as f32 * exact / 2048.0 + 1e-6;
                assert!(near(share, opacity / diameter.powi(2)), "{name}, level {k}, {at}: {share}, {opacity}");
                let texels = directions(&map, at, edge);
                let mut photons = [Vec4::ZERO; TEXELS];
                for at in below() {
                    directions(&base[0], at, EDGE).iter().zip(&mut photons).for_each(|(t, sum)| *sum += *t);
                }
                for (t, photons) in texels.iter().zip(photons) {
                    let radiance = photons / diameter.powi(2);
                    assert!((0..4).all(|c| near(t[c], radiance[c])), "{name}, level {k}, {at}: {t}, {radiance}");
                    summed += usize::from(photons.w > 0.0);
                    most = most.max(t.w);
                }
                if name == "wall" && at.x == 5 >> k {
                    let lit = texels.iter().filter(|t| t.x > 0.0);
                    assert!(lit.clone().count() >= 4 && (share - 1.0).abs() < 1e-3, "level {k}, {at}");
                    for t in lit {
                        assert!((t.x / (2.0 * scale) - 1.0).abs() < 2e-3, "level {k}, {at}: {t}");
                    }
                }
            }
        }
        assert!(summed > 5000, "{name}: {summed} sums are a test of little");
        assert!((most > 1.05) == (name == "confetti"), "{name}: {most} at most, uncut");
    }
}

#[test]
fn mips_hide_no_more_than_all_and_are_no_brighter_than_what_is_in_them() {
    let context = gpu::context();
    let renderer = gpu::render(&context, &confetti(), &settings(&[]), 16);
    let brightest = 1.1 * renderer.frame().scale;
    for (i, image) in renderer.frame().method.images().into_iter().enumerate() {
        for k in 0..=EDGE.ilog2() {
            for t in level(&context, image, k) {
                let bounded = if i == 0 { t.w.max(t.w) } else { t.max_element() };
                assert!(t.is_finite() && t.min_element() >= 0.0 && bounded <= 1.0, "level {k}: {t}");
                // Two roundings to f16 for each level.
                assert!(i > 0 || t.truncate().max_element() <= 1.02 * brightest * t.w + 1e-3, "level {k}: {t}");
            }
        }
    }
}
