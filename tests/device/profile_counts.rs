//! Counts of an instrumented frame, against numbers that are known otherwise: a copy's bytes, single reads of lists,
//! mips.

use crate::gpu;

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::scenes::{Random, add, triangle};
use glam::{DAffine3, Vec3, Vec4};
use twobounce::gi::cones::choices::{Form, Passes};
use twobounce::profile::RepeatedFrame;
use twobounce::profile::copy::Copy;
use twobounce::profile::counts::Counts;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{Alpha, Material, Mesh, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::Context;

const EDGE: u32 = 16;

#[test]
fn a_copy_reads_the_bytes_that_it_copies() {
    let context = gpu::counting();
    // The last size is no multiple of a workgroup's bytes.
    for bytes in [16, 1 << 20, (1 << 20) + 48] {
        let copy = Copy::new(&context, bytes).unwrap();
        for _ in 0..2 {
            let (_, counts) = copy.run().unwrap();
            assert!(counts.invocations > 0);
            assert_eq!(counts, Counts { words: bytes / 4, invocations: counts.invocations, ..Default::default() });
            assert_eq!(counts.fetched_bytes(), bytes);
        }
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}

/// Triangles of several voxels, so that lists are longer than one.
fn confetti() -> Scene {
    let (mut scene, mut random) = (Scene::empty("confetti"), Random::new(3));
    for i in 0..80 {
        let center = random.point() * 12.0 + 2.0;
        let lamp = Material::lamp("lamp", random.point().as_vec3());
        add(
            &mut scene,
            &[triangle(&mut random, center, 5.0)],
            Material { base_color: Vec4::splat(0.5), double_sided: i % 2 == 0, ..lamp },
        );
    }
    scene.sky = Vec3::splat(0.5);
    scene
}

fn counted(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Vec<(&'static str, Counts)> {
    let pose = scene.pose(None, 0.0);
    let view = View::framing(scene.bounds(None));
    let subject = RepeatedFrame {
        scene,
        pose: &pose,
        view: &view,
        settings: settings.clone(),
        options: RenderOptions::new((24, 16), scene.bounds(None)),
        check: || Ok(()),
    };
    subject.count(context).unwrap()
}

#[test]
fn a_frame_without_shadows_reads_what_its_lists_say() {
    let scene = confetti();
    let (plain, context) = (gpu::context(), gpu::counting());
    for preset in [Settings::cones(), Settings::printed()] {
        let settings = gpu::with(preset, &["voxels=16", "lights.shadows=none", "lights.lamps=gathered"]);
        let rows = counted(&context, &scene, &settings);
        assert_eq!(context.take_validation_messages(), Vec::<String>::new());
        let whole = |name: &str| rows.iter().find(|row| row.0 == name).unwrap_or_else(|| panic!("no pass {name}")).1;
        let of = |name: &str| Counts { invocations: 0, ..whole(name) };
        let frame = gpu::render(&plain, &scene, &settings, 16);
        let pairs = gpu::listed_pairs(&plain, &frame);
        let items = pairs.len() as u64;
        let cells: BTreeSet<[u32; 3]> =
            pairs.iter().map(|(v, _)| [v % EDGE, v / EDGE % EDGE, v / EDGE / EDGE]).collect();
        // Cells: occupied cells and their parents. Layered: every voxel.
        let by_cells = settings.of.cones.passes == Passes::Cells;
        assert!(items > 500, "{items} items are a test of little");
        let voxels = if by_cells { cells.len() as u64 } else { u64::from(EDGE).pow(3) };
        let lit = Counts { list_items: items, triangles: items, materials: items, ..Default::default() };
        // By cells, a second pass fills voxels from the light of items: eight words each.
        let shade = if by_cells {
            let (list_items, materials, corners, words) = (2 * items, 2 * items, 3 * items, 8 * items);
            Counts { heads: voxels, list_items, materials, corners, words, ..lit }
        } else {
            Counts { heads: voxels, ..lit }
        };
        assert_eq!(of("shade 1"), shade);
        // A fragment per voxel where all are drawn, else whole groups of threads.
        let invocations = whole("shade 1").invocations;
        assert!(if by_cells { invocations >= items + voxels } else { invocations == voxels }, "{invocations}");
        let second = of("shade 2");
        let (cone_steps, volume_texels) = (second.cone_steps, second.volume_texels);
        // By cells, the first bounce's direct light is read again: three words a side, of one or two sides.
        let direct = second.words - shade.words;
        assert!(if by_cells { direct % 3 == 0 && (3 * items..=6 * items).contains(&direct) } else { direct == 0 });
        assert_eq!(second, Counts { cone_steps, volume_texels, words: second.words, ..shade });
        assert!(cone_steps > items, "{second:?}");
        // Seven faces of eight texels for every texel of every coarser level; D2, printed, reads two more.
        let occupied = |level: u32| cells.iter().map(|v| v.map(|x| x >> level)).collect::<BTreeSet<_>>().len() as u64;
        let all = |level: u32| u64::from(EDGE >> level).pow(3);
        let parents: u64 = (1..=EDGE.ilog2()).map(|level| if by_cells { occupied(level) } else { all(level) }).sum();
        let per_parent = if settings.of.cones.ledger.d2 == Form::Printed { 58 } else { 56 };
        for name in ["mips 1", "mips 2"] {
            assert_eq!(of(name), Counts { volume_texels: per_parent * parents, ..Default::default() }, "{name}");
        }
        assert_eq!(of("record").scene_vertices, 3 * 80);
        assert_eq!(of("voxelise").heads, items);
    }
}

/// A CPU device ends an invocation's loops after 65535 rounds over all of its rays. Rays that restarted behind every
/// leaf of a thicket were cut off, different ones in every run: 22 of this image.
#[test]
fn no_ray_through_a_thicket_is_cut_off() {
    let (mut scene, mut random) = (Scene::empty("thicket"), Random::new(21));
    let absent = Material { alpha: Alpha::Mask(0.5), double_sided: true, ..Material::lambert("leaf", Vec3::ONE) };
    let leaf = Material { base_color: Vec4::new(1.0, 1.0, 1.0, 0.1), ..absent };
    for _ in 0..2000 {
        let center = random.point() * 12.0 + 2.0;
        add(&mut scene, &[triangle(&mut random, center, 4.0)], leaf.clone());
    }
    let floor = scene.add_material(Material::lambert("floor", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::quad("floor", floor, Vec3::ZERO, 16.0 * Vec3::Z, 16.0 * Vec3::X), DAffine3::IDENTITY);
    scene.sky = Vec3::splat(0.5);
    let context = gpu::counting();
    let settings = gpu::with(Settings::accurate(), &["voxels=16", "rays.tracer=tree"]);
    let rows = counted(&context, &scene, &settings);
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    let sum = |of: fn(&Counts) -> u64| rows.iter().map(|row| of(&row.1)).sum::<u64>();
    println!("{} rays cut off, {} steps", sum(|c| c.rays_cut), sum(|c| c.ray_steps));
    assert!(sum(|c| c.ray_steps) > 300_000, "a test of little");
    assert_eq!(sum(|c| c.rays_cut), 0);
}

/// The depth pass reads equally many fragments whether masks leave holes in them or not.
#[test]
fn fragments_in_holes_count_too() {
    let looked_at = |alpha: f32| {
        let mut scene = confetti();
        for material in &mut scene.materials {
            (material.alpha, material.base_color.w) = (Alpha::Mask(0.5), alpha);
        }
        let fast = gpu::with(Settings::fast(), &["voxels=16"]);
        let rows = counted(&gpu::counting(), &scene, &fast);
        rows.iter().find(|row| row.0 == "visibility").expect("a depth pass").1.triangles
    };
    let (holes, whole) = (looked_at(0.1), looked_at(0.9));
    assert!(holes >= whole && whole > 0, "{holes} {whole}");
}

#[test]
fn an_instrumented_frame_is_the_same_image() {
    let scene = confetti();
    let settings = Settings { voxels: EDGE, ..Settings::fast() };
    let image = |context: Arc<Context>| {
        let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
        let options = RenderOptions::new((24, 16), bounds);
        let mut renderer = Renderer::new(&context, scene.clone(), &pose, settings.clone(), options).unwrap();
        renderer.render(&pose, &View::framing(bounds)).unwrap();
        let bits = |p: &[f32; 3]| p.map(f32::to_bits);
        renderer.read().beauty().iter().map(bits).collect::<Vec<_>>()
    };
    assert_eq!(image(gpu::context()), image(gpu::counting()));
}
