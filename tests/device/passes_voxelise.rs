//! Recording and voxelisation against an independent oracle: the listed pairs equal those of clipping in f64, by
//! compute passes and by the talk's geometry shaders. Where the device rasterises conservatively, its lists are equal
//! too; elsewhere that setting is refused, and its outlines are compared with a twin.

use crate::gpu;
use crate::studio::asset;

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::io::Write;
use std::path::Path;
use std::process::Command;

use crate::scenes::{Random, add, triangle};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use gpu::twins::dilate::outline;
use gpu::twins::record::{in_voxels, record};
use gpu::twins::voxelise::{Pair, PairComparison, Polygon, compare_sets, voxelise, voxelise_dilated};
use twobounce::ground::expected_items::expected_items;
use twobounce::ground::layout::{Globals, GridPush, Triangle};
use twobounce::scene::{LoadOptions, Material, Mesh, Scene};
use twobounce::settings::{Bounces, Center, Conservative, Settings};
use twobounce::vk::{Bind, Raster, RasterDesc, Recorder, RecorderOptions, RenderTarget, download};

/// The talk's shading by cells, one bounce.
fn cells(edge: u32) -> Settings {
    let settings = Settings { voxels: edge, bounces: Bounces::One, ..Settings::corrected() };
    gpu::with(settings, &["cones.passes=cells"])
}

/// A grid of 1 m voxels from the origin on.
fn metre_grid(edge: u32) -> Settings {
    let mut settings = cells(edge);
    settings.grid.center = Center::Point([f64::from(edge) / 2.0; 3]);
    settings.grid.side = Some(f64::from(edge));
    settings
}

/// The scene's triangles, rounded to f32 as on the device.
fn compare(scene: &Scene, settings: &Settings) -> PairComparison {
    let context = gpu::context();
    let renderer = gpu::render(&context, scene, settings, 16);
    let grid = &renderer.ground().desc.grid;
    let recorded = record(scene, &scene.pose(None, 0.0));
    let triangles = in_voxels(&recorded, grid.corner, grid.voxel_m);
    compare_sets(&gpu::listed_pairs(&context, &renderer), &voxelise(&triangles, settings.voxels))
}

fn of_triangles(triangles: &[[DVec3; 3]]) -> Scene {
    let mut scene = Scene::empty("triangles");
    add(&mut scene, triangles, Material { double_sided: true, ..Material::lamp("lamp", Vec3::ONE) });
    scene
}

/// All ways to record and list triangles that the device offers.
fn all_ways(settings: &Settings) -> impl Iterator<Item = Settings> {
    let hardware = gpu::context().conservative_rasterization;
    let ways = Conservative::ALL.iter().filter(move |way| hardware || **way != Conservative::Hardware);
    ways.map(|way| gpu::with(settings.clone(), &[&format!("grid.conservative={way}")]))
}

fn is_exact(scene: &Scene, settings: &Settings) -> PairComparison {
    let is_exact = |settings: Settings| {
        let found = compare(scene, &settings);
        let by = settings.grid.conservative;
        assert_eq!((found.recall, found.precision), (1.0, 1.0), "{} by {by}: {found:?}", scene.name);
        found
    };
    all_ways(settings).map(is_exact).last().expect("there are ways")
}

fn slivers(count: usize) -> Vec<[DVec3; 3]> {
    let (mut random, limit) = (Random::new(1), DVec3::splat(64.0));
    let mut sliver = || {
        let a = random.point() * 64.0;
        let b = a + (random.point() - 0.5) * 32.0;
        [a, b, b + (random.point() - 0.5) * 0.02].map(|p| p.clamp(DVec3::ZERO, limit).as_vec3().as_dvec3())
    };
    (0..count).map(|_| sliver()).collect()
}

#[test]
fn a_hundred_thousand_slivers_are_listed_exactly() {
    // Up to 32 voxels long and at most 0.02 wide: the normal from a plain cross product is wrong by more than a voxel's
    // slack.
    let found = is_exact(&of_triangles(&slivers(100_000)), &metre_grid(64));
    assert!(found.touching < 0.01, "{found:?}");
}

/// A third are needles, a third are smaller than a voxel of any grid up to 256, a third are of any shape.
fn needles_and_tiny_triangles() -> Vec<[DVec3; 3]> {
    let mut random = Random::new(3);
    let mut triangle = |i: usize| {
        let a = random.point();
        let (b, c) = match i % 3 {
            0 => (random.point(), 1e-4 * (random.point() - 0.5)),
            1 => (a + 2e-3 * (random.point() - 0.5), 2e-3 * (random.point() - 0.5)),
            _ => (random.point(), random.point() - 0.5),
        };
        [a, b, b + c].map(|p| (64.0 * p.clamp(DVec3::ZERO, DVec3::ONE)).as_vec3().as_dvec3())
    };
    (0..3000).map(&mut triangle).collect()
}

#[test]
fn needles_and_tiny_triangles_are_listed_exactly() {
    let found = is_exact(&of_triangles(&needles_and_tiny_triangles()), &metre_grid(64));
    assert!(found.touching < 0.01, "{found:?}");
}

#[test]
fn triangles_of_every_size_and_tilt_are_listed_exactly() {
    let mut random = Random::new(2);
    let mut triangles = Vec::new();
    for i in 0..6000 {
        // From a fiftieth of a voxel to the whole grid; every third lies nearly in an axis plane.
        let size = 0.02 * 1600f64.powf(random.unit());
        let center = random.point() * 32.0;
        let squash = if i % 3 == 0 { DVec3::new(1.0, 1e-3, 1.0) } else { DVec3::ONE };
        let t = triangle(&mut random, DVec3::ZERO, size);
        let inside = |p: DVec3| p.clamp(DVec3::splat(0.3), DVec3::splat(31.7)).as_vec3().as_dvec3();
        triangles.push(t.map(|p| inside(center + p * squash)));
    }
    let found = is_exact(&of_triangles(&triangles), &metre_grid(32));
    assert!(found.touching < 0.01, "{found:?}");
}

/// D30: the talk tests the dilated triangle.
#[test]
fn dilated_triangles_are_listed_where_their_twin_lists_them() {
    let mut random = Random::new(4);
    // Nearly equilateral, three voxels large, in every plane.
    let mut triangle = || {
        let (center, x) = (random.point() * 8.0 + 4.0, random.direction());
        let y = x.cross(random.direction()).normalize();
        [0.0, 2.0, 4.0].map(|k: f64| {
            let (sin, cos) = (k * PI / 3.0 + 0.3 * random.unit()).sin_cos();
            (center + 1.7 * (cos * x + sin * y)).as_vec3().as_dvec3()
        })
    };
    let triangles: Vec<_> = (0..200).map(|_| triangle()).collect();
    let (context, scene) = (gpu::context(), of_triangles(&triangles));
    let renderer = gpu::render(&context, &scene, &gpu::with(metre_grid(16), &["cones.ledger.d30=printed"]), 16);
    let found = gpu::listed_pairs(&context, &renderer);
    let compared = compare_sets(&found, &voxelise_dilated(&triangles, 16));
    assert_eq!((compared.recall, compared.precision), (1.0, 1.0), "{compared:?}");
    assert!(compared.touching < 0.1, "{compared:?}");
    // The triangles' own pairs are listed as before, and a third more.
    let exact = voxelise(&triangles, 16);
    assert_eq!(compare_sets(&found, &exact).recall, 1.0);
    assert!(found.len() > 4 * exact.certain.len() / 3, "{} of {}", found.len(), exact.certain.len());
}

/// The ledger's row states how much longer the lists become in a scene with triangles smaller than a voxel.
#[test]
fn the_gallerys_dilated_lists_are_twice_as_long() {
    let (context, scene) = (gpu::context(), asset("gallery.glb"));
    let listed = |form| gpu::listed_pairs(&context, &gpu::render(&context, &scene, &gpu::with(cells(32), &[form]), 16));
    let [exact, dilated] = ["cones.ledger.d30=right", "cones.ledger.d30=printed"].map(listed);
    let held: BTreeSet<_> = dilated.iter().collect();
    assert!(exact.iter().all(|pair| held.contains(pair)));
    let ratio = dilated.len() as f64 / exact.len() as f64;
    assert!((2.2..2.25).contains(&ratio), "{ratio}");
}

#[test]
fn rooms_are_listed_exactly() {
    for name in ["cornell-point", "cornell-area", "gallery"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/{name}.glb"));
        let scene = Scene::load(&path, &LoadOptions::default()).expect(name);
        is_exact(&scene, &cells(64));
    }
}

#[test]
fn walls_in_voxel_faces_touch_both_sides_and_break_nothing() {
    // Triangles that touch voxels exactly: either answer is right for those, and every certain pair must be listed.
    let mut scene = Scene::empty("box on voxel faces");
    let material = scene.add_material(Material::default());
    let cuboid = Mesh::cuboid("box", material, Vec3::splat(4.0), Vec3::splat(12.0), false);
    scene.add_mesh(cuboid, DAffine3::IDENTITY);
    assert!(is_exact(&scene, &metre_grid(16)).touching > 0.5);
}

/// Lists begin with the length that [`expected_items`] predicts, which is a mean over positions of the grid.
#[test]
fn lists_are_as_long_as_geometry_says() {
    let mut random = Random::new(5);
    let mut place = |k: usize| {
        let center = random.point() * 24.0 + 4.0;
        triangle(&mut random, center, [0.1, 1.0, 8.0][k % 3])
    };
    let triangles: Vec<_> = (0..3000).map(&mut place).collect();
    let scene = of_triangles(&triangles);
    let context = gpu::context();
    let renderer = gpu::render(&context, &scene, &metre_grid(32), 16);
    let grid = &renderer.ground().desc.grid;
    let expected = expected_items(&scene, &scene.pose(None, 0.0).world_from_instance, grid).items;
    let listed = gpu::listed_pairs(&context, &renderer).len() as f64;
    // Some thousand triangles do not cover all positions.
    assert!((listed / expected - 1.0).abs() < 0.02, "{listed} items, {expected} expected");
}

#[test]
fn a_mirrored_instance_keeps_its_front() {
    let mut scene = Scene::empty("a box and its mirror image");
    let material = scene.add_material(Material::default());
    let mesh = Mesh::cuboid("box", material, Vec3::ONE, Vec3::new(2.0, 3.0, 4.0), false);
    scene.add_mesh(mesh.clone(), DAffine3::IDENTITY);
    scene.add_mesh(mesh, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
    let context = gpu::context();
    for settings in all_ways(&cells(16)) {
        let renderer = gpu::render(&context, &scene, &settings, 16);
        let triangles: Vec<Triangle> = download(&context, &renderer.ground().triangles).expect("triangles");
        assert_eq!(triangles.len(), 24);
        let words: Vec<u32> = download(&context, &renderer.ground().attributes).expect("attributes");
        for (place, t) in triangles.iter().enumerate() {
            let [a, b, c] = t.corners.map(Vec3::from);
            let normal = renderer.ground().scene.corner.normal(&words, place, 0);
            let facing = (b - a).cross(c - a).normalize().dot(Vec3::from(normal));
            assert!((facing - 1.0).abs() < 1e-4, "triangle {}: its winding and its normal are {facing}", t.source);
        }
    }
}

/// Bit for bit, with all attributes of corners, in any order.
#[test]
fn every_way_records_the_same() {
    let context = gpu::context();
    for name in ["gallery", "demo"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/{name}.glb"));
        let mut scene = Scene::load(&path, &LoadOptions::default()).expect(name);
        // One without area, and one in a mesh of its own.
        let at = |x: f32| Vec3::new(x, 0.5, 0.5);
        let flat = [at(0.1), at(0.2), at(0.3)].map(|p| p.as_dvec3());
        add(&mut scene, &[flat, [flat[0], flat[1], flat[2] + DVec3::Y]], Material::default());
        let recorded = |settings: Settings| {
            let renderer = gpu::render(&context, &scene, &settings, 16);
            let ground = renderer.ground();
            let globals: Vec<Globals> = download(&context, &ground.base().globals).expect("counters");
            let triangles: Vec<Triangle> = download(&context, &ground.triangles).expect("triangles");
            let words: Vec<u32> = download(&context, &ground.attributes).expect("attributes");
            let count = globals[0].vertex_count as usize / 3;
            let corner_words = 3 * ground.scene.corner.count;
            let places = triangles[..count].iter().zip(words.chunks(corner_words));
            let by_source = places.map(|(t, words)| (t.source, (bytemuck::bytes_of(t).to_vec(), words.to_vec())));
            (globals[0].degenerate_count, by_source.collect::<BTreeMap<_, _>>())
        };
        let all: Vec<_> = all_ways(&cells(16)).map(recorded).collect();
        assert!(all[0].0 > 0 && all[0].1.len() + all[0].0 as usize == scene.triangle_count() as usize);
        assert!(all.iter().all(|other| *other == all[0]), "{name}");
    }
}

#[test]
fn hardware_that_cannot_is_refused_in_one_sentence() {
    let context = gpu::context();
    if context.conservative_rasterization {
        return; // the tests above ran on it
    }
    // Written to the terminal itself, because the harness captures the output of passing tests.
    let notice =
        format!("{} has no VK_EXT_conservative_rasterization: lists by hardware are not tested\n", context.name);
    std::io::stderr().write_all(notice.as_bytes()).expect("a terminal");
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    let args = ["render", "assets/cornell-point.glb", "-o", "never.png", "--set", "grid.conservative=hardware"];
    let output = command.args(args).args(["--set", "voxels=16", "--size", "8x8"]).output().expect("the program");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    let sentence = message.lines().last().expect("a sentence");
    for part in ["twobounce: grid.conservative = hardware", "VK_EXT_conservative_rasterization", "compute"] {
        assert!(sentence.contains(part), "{message}");
    }
}

/// The margin for snapping in `glsl/ground/voxelise.geom`.
const ROOM: f64 = 0.01;

/// The rule of every device with the extension: a fragment for every pixel that the snapped outline meets, one per
/// triangle.
#[test]
fn outlines_for_hardware_meet_every_column_once_snapped() {
    for triangles in [slivers(2000), needles_and_tiny_triangles()] {
        let outlines: Vec<_> = triangles.iter().map(|t| outline(t, ROOM, true)).collect();
        // To 8 bits below the pixel, as devices with the extension do.
        let snapped = |p: DVec2| (p * 256.0).round() / 256.0;
        let snapped: Vec<_> = outlines.iter().map(|o| o.triangles[0].map(|p| snapped(p).extend(0.0))).collect();
        for (outline, [a, b, c]) in outlines.iter().zip(&snapped) {
            assert_eq!(outline.triangles.len(), 1);
            assert!((*b - *a).cross(*c - *a) != DVec3::ZERO, "no area: a device may drop it");
        }
        for (voxel, t) in voxelise(&triangles, 64).certain {
            let [u, v] = column(voxel, 64, outlines[t as usize].axis);
            let (low, high) = (DVec3::new(u, v, -1.0), DVec3::new(u + 1.0, v + 1.0, 1.0));
            let meets = !Polygon::clipped(&snapped[t as usize], low, high).corners.is_empty();
            assert!(meets, "triangle {t} misses the column of voxel {voxel}");
        }
    }
}

/// The pixel of a voxel, seen along an axis.
fn column(voxel: u32, edge: u32, axis: usize) -> [f64; 2] {
    let at = [voxel % edge, voxel / edge % edge, voxel / edge / edge].map(f64::from);
    [at[(axis + 1) % 3], at[(axis + 2) % 3]]
}

/// The shader emits the twin's outlines: rasterised by the pixels' middles, they list their own voxels.
#[test]
fn outlines_are_their_twins() {
    let (context, triangles, settings) = (gpu::context(), needles_and_tiny_triangles(), metre_grid(64));
    let renderer = gpu::render(&context, &of_triangles(&triangles), &settings, 16);
    let exact = voxelise(&triangles, 64);
    for (hardware, dilation) in [(0u32, 0.5 + ROOM), (1, ROOM)] {
        let desc = RasterDesc {
            label: "outlines",
            vertex: "ground/voxelise.vert",
            geometry: Some("ground/voxelise.geom"),
            fragment: Some("ground/voxelise.frag"),
            constants: &[("EDGE", 64u32.into()), ("HARDWARE", hardware.into())],
            ..Default::default()
        };
        let pipeline = Raster::new(&context, &desc).expect("a pipeline");
        let (ground, lists) = (renderer.ground(), renderer.ground().base());
        let mut recorder = Recorder::new(&context, RecorderOptions::default()).expect("a recorder");
        lists.reset(&mut recorder);
        recorder.full_barrier();
        recorder.raster(&RenderTarget { width: 64, height: 64, ..Default::default() }, |pass| {
            let mut binds = ground.binds();
            binds.push(Bind::buffer("cells", &lists.cells.cells));
            pass.draw(
                &pipeline,
                &pipeline.select(&binds),
                &GridPush { offset: [0.0; 3], scale: 1.0, first: 0, hole: [0; 3], hole_edge: 0 },
                ground.recorded(),
            );
        });
        recorder.finish().expect("a frame");
        let found = gpu::listed_pairs(&context, &renderer);
        // The distance of the pixel's middle to the outline in pixels, positive inside.
        let inside = |&(voxel, t): &Pair| {
            let outline = outline(&triangles[t as usize], dilation, hardware == 1);
            let middle = DVec2::from(column(voxel, 64, outline.axis)) + 0.5;
            let depth = |t: &[DVec2; 3]| {
                let side = |i: usize| {
                    let (from, to) = (t[i], t[(i + 1) % 3]);
                    (to - from).normalize().perp_dot(middle - from)
                };
                let turned = (t[1] - t[0]).perp_dot(t[2] - t[0]).signum();
                (0..3).map(|i| turned * side(i)).fold(f64::INFINITY, f64::min)
            };
            outline.triangles.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)
        };
        // Snapping moves corners by 1/512, and f32 may choose the other of two nearly equal edges as the longest.
        let rounding = 1.0 / 64.0;
        let kept: BTreeSet<_> = found.iter().copied().collect();
        assert_eq!(kept.len(), found.len(), "no pair is listed twice");
        let expected = exact.certain.iter().filter(|pair| inside(pair) > rounding);
        let missing = expected.clone().filter(|pair| !kept.contains(pair)).count();
        let wrong = kept.iter().filter(|pair| inside(pair) < -rounding).count();
        assert_eq!((missing, wrong), (0, 0), "hardware {hardware}: of {}", found.len());
        assert!(expected.count() > 20_000);
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}
