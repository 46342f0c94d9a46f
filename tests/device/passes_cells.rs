//! Passes by cells: lists of occupied cells against their twin, and volumes against those of layered passes, bit for
//! bit, in a first frame and after motion.

use crate::gpu;

use std::collections::{BTreeMap, BTreeSet};

use crate::scenes::{Random, add, triangle};
use crate::studio::{Studio, Volumes, pose, room};
use glam::{DAffine3, DVec3, IVec3, Vec3};
use gpu::twins::cells::parents;
use gpu::twins::item_groups::{Listed, groups};
use gpu::twins::voxelise::Polygon;
use half::f16;
use twobounce::ground::cells::LIT_COUNTS;
use twobounce::ground::layout::{Globals, ItemLight, ItemPart, ListCount, ListItem, Triangle};
use twobounce::scene::{Alpha, LightKind, Material, Mesh, Scene};
use twobounce::settings::{Bounces, Center, Settings};
use twobounce::vk::download;

const EDGE: u32 = 16;

/// The talk's passes, layer by layer, with few cones, because the comparison is about which voxels are shaded.
fn layered() -> [Settings; 3] {
    let small = |settings: Settings, changes: &[&str]| {
        let small = ["voxels=16", "cones.passes=layered", "cones.shadow_jitter=false"]; // which is another one in each frame
        gpu::with(gpu::with(settings, &small), changes)
    };
    [
        small(Settings::cones(), &["cones.set=g4"]),
        small(Settings::printed(), &[]),
        small(
            Settings::corrected(),
            &["cones.fill=coverage", "lights.shadows=rays", "cones.first_bounce_shadows=true"],
        ),
    ]
}

#[test]
fn every_level_lists_the_parents_of_occupied_voxels() {
    let scene = room();
    let mut studio = Studio::new(&scene, &Settings { voxels: EDGE, ..Settings::fast() });
    studio.volumes(&scene.pose(None, 0.0));
    let pairs = gpu::listed_pairs(&studio.context, &studio.renderer);
    let occupied: Vec<u32> = pairs.iter().map(|p| p.0).collect();
    let lists = &studio.renderer.ground().base().cells;
    let counts: Vec<ListCount> = download(&studio.context, &lists.counts).expect("counts");
    let listed: Vec<u32> = download(&studio.context, &lists.parents).expect("parents");
    let twin = parents(&occupied, EDGE);
    let mut first = 0;
    for (level, expected) in twin.iter().enumerate() {
        let ListCount { groups_x, groups_y, groups_z, count } = counts[level];
        assert_eq!(count as usize, expected.len(), "level {level}");
        assert_eq!([groups_x, groups_y, groups_z], [count.div_ceil(64), 1, 1], "level {level}");
        if level > 0 {
            let found: BTreeSet<u32> = listed[first..first + count as usize].iter().copied().collect();
            assert_eq!(&found, expected, "level {level}");
            first += (EDGE as usize >> level).pow(3);
        }
    }
    assert!(twin[1].len() > 100);
}

#[test]
fn cells_give_the_bits_of_layers() {
    let scene = room();
    let (here, there) = (pose(&scene, DVec3::new(1.0, 1.0, 1.0)), pose(&scene, DVec3::new(5.0, 4.0, 3.0)));
    for layered in layered() {
        let first = Studio::new(&scene, &layered).volumes(&here);
        let moved = Studio::new(&scene, &layered).volumes(&there);
        assert!(first.iter().zip(&moved).all(|(a, b)| a != b), "the box shows");
        let fill = layered.of.cones.fill;
        // Direct light is stored between the bounces of two of the three; the stored light equals a new evaluation.
        let mut studio = Studio::new(&scene, &gpu::with(layered, &["cones.passes=cells"]));
        let mut holds = |pose, expected, when| {
            let found = studio.volumes(pose);
            let (share, off) = difference(&found, expected);
            // A GPU's compiler contracts products and sums differently in fragment and compute shaders: rounding, and
            // now and then a cone that meets another voxel.
            let holds = if studio.context.is_cpu { found == *expected } else { share < 0.01 && off < 1e-3 };
            assert!(holds, "{fill}: {when}: {share} of the values differ by more than 2⁻⁹, the mean by {off}");
        };
        holds(&here, &first, "first frame");
        holds(&there, &moved, "after the box moved");
        holds(&here, &first, "after it came back");
    }
}

/// Share of the values that differ by more than a rounding of a half or two, and mean |difference| over the mean.
fn difference(a: &Volumes, b: &Volumes) -> (f64, f64) {
    let values = |v: &Volumes| -> Vec<f64> {
        let texels = v.iter().flatten().flatten().flatten().flatten();
        texels.map(|bits| f64::from(f16::from_bits(*bits))).collect()
    };
    let (a, b) = (values(a), values(b));
    let apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).collect();
    let differ = apart.iter().zip(&b).filter(|(apart, b)| **apart > b.abs() / 512.0).count();
    (differ as f64 / a.len() as f64, apart.iter().sum::<f64>() / b.iter().sum::<f64>())
}

#[test]
fn lists_that_had_to_grow_leave_nothing_behind() {
    // Twelve sheets of 64² voxels: more cells than the first lists hold.
    let mut scene = Scene::empty("sheets");
    let material = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    for k in 0..12 {
        let y = f64::from(k) * 5.0 + 0.5;
        let corner = |x: f64, z: f64| DVec3::new(x, y, z).as_vec3();
        let triangles = [
            [corner(0.5, 0.5), corner(0.5, 63.5), corner(63.5, 0.5)],
            [corner(63.5, 63.5), corner(63.5, 0.5), corner(0.5, 63.5)],
        ];
        scene.add_mesh(Mesh::triangles("sheet", material, &triangles), DAffine3::IDENTITY);
    }
    let mut layered = Settings { voxels: 64, bounces: Bounces::One, ..layered()[0].clone() };
    layered.grid.center = Center::Point([32.0; 3]);
    layered.grid.side = Some(64.0);
    let cells = gpu::with(layered.clone(), &["cones.passes=cells"]);
    let pose = scene.pose(None, 0.0);
    let mut studio = Studio::new(&scene, &cells);
    let found = studio.volumes(&pose);
    let occupied = studio.renderer.render(&pose, &studio.view).expect("a frame").counters.occupied_voxels;
    assert!(occupied > 1 << 15, "{occupied} cells are not more than there is room for");
    assert!(found == Studio::new(&scene, &layered).volumes(&pose));
}

/// Small triangles, many to a voxel: in a ball, a few of two materials and a few masked.
fn crumbs() -> Scene {
    let (mut scene, mut random) = (Scene::empty("crumbs"), Random::new(5));
    for alpha in [Alpha::Opaque, Alpha::Opaque, Alpha::Mask(0.5)] {
        let mut crumb = || {
            let center = random.point() * 4.0;
            triangle(&mut random, center, 0.4)
        };
        let many: Vec<_> = (0..3000).map(|_| crumb()).collect();
        add(&mut scene, &many, Material { alpha, ..Material::lambert("crumbs", Vec3::splat(0.5)) });
    }
    scene
}

#[test]
fn one_of_the_triangles_that_are_alike_is_lit_for_all() {
    let scene = crumbs();
    let settings = Settings { voxels: EDGE, ..Settings::fast() };
    let mut studio = Studio::new(&scene, &settings);
    studio.renderer.change(settings, (96, 96)).expect("it fits"); // an image for which everything is lit
    studio.volumes(&scene.pose(None, 0.0));
    let (context, ground) = (&studio.context, studio.renderer.ground());
    let lists_of_all = ground.base();
    let items: Vec<ListItem> = download(context, &lists_of_all.items).expect("items");
    let triangles: Vec<Triangle> = download(context, &ground.triangles).expect("triangles");
    let parts: Vec<ItemPart> = download(context, &lists_of_all.item_parts).expect("parts");
    let lit: Vec<u32> = download(context, &lists_of_all.lit_items).expect("lit items");
    let counts: Vec<ListCount> = download(context, &lists_of_all.cells.counts).expect("counts");
    let globals: Globals = download(context, &lists_of_all.globals).expect("counters")[0];

    let mut lists: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    let is_twin = |item: usize| parts[item].twin as usize == item + 1;
    for (item, listed) in items.iter().take(globals.item_count as usize).enumerate().filter(|(item, _)| !is_twin(*item))
    {
        lists.entry(listed.voxel).or_default().push(item);
    }
    let corners =
        |item: usize| triangles[items[item].triangle as usize].corners.map(|v| Vec3::from_array(v).as_dvec3());
    let mut chosen = BTreeSet::new();
    for (voxel, list) in lists {
        let low = IVec3::from([voxel % EDGE, voxel / EDGE % EDGE, voxel / EDGE / EDGE].map(|v| v as i32)).as_dvec3();
        let area = |item| Polygon::clipped(&corners(item), low, low + 1.0).area_vector().length();
        let listed: Vec<Listed> = list
            .iter()
            .map(|&item| {
                let ([a, b, c], material) = (corners(item), triangles[items[item].triangle as usize].material);
                Listed { normal: (b - a).cross(c - a), material, shares: material != 2 }
            })
            .collect();
        for group in groups(&listed) {
            let lit_by = parts[list[group[0]]].lit_by as usize;
            chosen.insert(lit_by as u32);
            let largest = group.iter().map(|&k| area(list[k])).fold(0.0, f64::max);
            assert!(group.iter().any(|&k| list[k] == lit_by), "the lit item is of the group");
            assert!(area(lit_by) > largest - 1e-4, "{} of {largest}", area(lit_by));
            for item in group.iter().map(|&k| list[k]) {
                assert_eq!(parts[item].lit_by as usize, lit_by);
                // Corners are f32 numbers of voxels up to 16: areas are off by a few 1e-6.
                assert!((f64::from(parts[item].area) - area(item)).abs() < 1e-4);
            }
        }
    }
    let ListCount { groups_x, count, .. } = counts[LIT_COUNTS as usize];
    let (twins, lit): (BTreeSet<u32>, BTreeSet<u32>) =
        lit[..count as usize].iter().partition(|item| is_twin(**item as usize));
    assert_eq!(lit, chosen);
    assert_eq!((count as usize, groups_x), (chosen.len() + twins.len(), count.div_ceil(64)));
    assert!(count > 500 && count + 500 < globals.item_count, "{count} lit of {}", globals.item_count);
}

/// Light that the front of each triangle (by its source) sends in each voxel that holds a part of it alone.
fn sent(studio: &Studio) -> BTreeMap<(u32, u32), [f32; 3]> {
    let (context, ground) = (&studio.context, studio.renderer.ground());
    let lists = ground.base();
    let globals: Vec<Globals> = download(context, &lists.globals).expect("counters");
    let items: Vec<ListItem> = download(context, &lists.items).expect("items");
    let parts: Vec<ItemPart> = download(context, &lists.item_parts).expect("parts");
    let lights: Vec<ItemLight> = download(context, &lists.item_lights).expect("lights");
    let triangles: Vec<Triangle> = download(context, &ground.triangles).expect("triangles");
    let alike = parts.len() >= items.len();
    let light_of = |index: usize| lights[if alike { parts[index].lit_by as usize } else { index }];
    let items = items.iter().enumerate().take(globals[0].item_count as usize);
    let area = |index: usize| if alike { parts[index].area } else { lights[index].area };
    let seen = items.filter(|(index, _)| area(*index) > 1e-3);
    seen.map(|(index, item)| ((item.voxel, triangles[item.triangle as usize].source), light_of(index).front)).collect()
}

#[test]
fn alike_triangles_in_the_same_light_send_the_same() {
    // A fine mesh of a sunlit ramp without shadows: all triangles have equal light.
    let mut scene = Scene::empty("ramp");
    let material = scene.add_material(Material::lambert("ramp", Vec3::splat(0.6)));
    let corner = |i: i32, j: i32| DVec3::new(f64::from(i), f64::from(i) * 0.1, f64::from(j)).as_vec3() / 8.0;
    let ramp: Vec<_> = (0..40 * 40)
        .map(|k| (k / 40, k % 40))
        .flat_map(|(i, j)| {
            let (a, b, c, d) = (corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j));
            [[a, b, c], [a, c, d]]
        })
        .collect();
    scene.add_mesh(Mesh::triangles("ramp", material, &ramp), DAffine3::IDENTITY);
    scene.add_light(LightKind::Directional, Vec3::splat(3.0), DAffine3::from_rotation_x(-1.2));
    let pose = scene.pose(None, 0.0);
    // The method cones lights each item, the method rays one item of each group.
    let [each, alike] = [Settings::cones(), Settings::fast()].map(|settings| {
        let settings = gpu::with(settings, &["voxels=16", "bounces=1", "lights.shadow_rays=1"]);
        let mut studio = Studio::new(&scene, &settings);
        studio.renderer.change(settings, (96, 96)).expect("it fits"); // an image for which everything is lit
        studio.image(&pose);
        sent(&studio)
    });
    assert!(each.len() == alike.len() && each.len() > 1000, "{} {}", each.len(), alike.len());
    for ((place, each), alike) in each.iter().zip(alike.values()) {
        assert!(each[0] > 0.1, "{each:?}: the ramp is lit");
        for (a, b) in each.iter().zip(alike) {
            // Facets' normals differ in their last bits.
            assert!((a - b).abs() <= 1e-3 * a.max(*b), "{place:?}: {each:?} {alike:?}");
        }
    }
}
