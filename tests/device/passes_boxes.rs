//! Boxes of finer voxels within the grid: their lists against a twin; the light that crosses their borders, which is
//! near the truth; and continuity where they move.

use crate::gpu;
use crate::scenes;
use crate::traced;

use glam::{DAffine3, DQuat, DVec3, IVec3, Vec3};
use gpu::twins::record::{in_voxels, record};
use gpu::twins::voxelise::{compare_sets, voxelise};
use scenes::{Random, add, triangle};
use twobounce::ground::boxes::FACTOR;
use twobounce::ground::grid_choice::fitted_to_camera;
use twobounce::layers::Aov;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Scene, Still, View};
use twobounce::settings::Settings;
use twobounce::stability::scenes::{ROOM, room, view};

const EDGE: u32 = 16;

fn rays(changes: &[&str]) -> Settings {
    gpu::with(Settings::fast(), &[&[&format!("voxels={EDGE}") as &str], changes].concat())
}

#[test]
fn every_box_lists_what_touches_its_voxels_and_leaves_out_what_the_next_one_has() {
    let (mut scene, mut random) = (Scene::empty("triangles"), Random::new(4));
    // Some triangles anywhere, some about the middle.
    let mut some = |size: f64, spread: f64| {
        let center = DVec3::splat(32.0) + (random.point() - 0.5) * spread;
        triangle(&mut random, center, size).map(|p| p.clamp(DVec3::ONE, DVec3::splat(63.0)).as_vec3().as_dvec3())
    };
    let triangles: Vec<_> = (0..400).map(|i| if i % 2 == 0 { some(40.0, 60.0) } else { some(2.0, 6.0) }).collect();
    add(&mut scene, &triangles, Material { double_sided: true, ..Material::lamp("lamp", Vec3::ONE) });
    // Boxes of 64, 16 and 4 m.
    let settings = rays(&["grid.side=4", "grid.center=32,32,32"]);
    let context = gpu::context();
    let renderer = gpu::render(&context, &scene, &settings, 16);
    let ground = renderer.ground();
    assert_eq!(ground.desc.grid.boxes, 2);
    let listed = gpu::listed_pairs(&context, &renderer);
    let recorded = record(&scene, &scene.pose(None, 0.0));
    let cells = EDGE.pow(3);
    let corner = |number: usize| if number == 0 { [0.0; 3] } else { ground.base().boxes[number - 1] };
    for number in 0..=2 {
        let voxel = FACTOR.powi(-(number as i32));
        let least = DVec3::from(corner(number).map(f64::from));
        let grid = &ground.desc.grid;
        let triangles = in_voxels(&recorded, grid.corner + least * grid.voxel_m, grid.voxel_m * voxel);
        let inner =
            if number < 2 { Some((DVec3::from(corner(number + 1).map(f64::from)) - least) / voxel) } else { None };
        let covered = |index: u32| {
            let cell = IVec3::new((index % EDGE) as i32, (index / EDGE % EDGE) as i32, (index / EDGE / EDGE) as i32);
            inner.is_some_and(|inner| {
                let from = cell - inner.as_ivec3();
                from.min_element() >= 0 && from.max_element() < EDGE as i32 / FACTOR as i32
            })
        };
        let mut exact = voxelise(&triangles, EDGE);
        exact.certain.retain(|pair| !covered(pair.0));
        exact.touching.retain(|pair| !covered(pair.0));
        assert!(exact.certain.len() > 100, "box {number} is nearly empty");
        let first = number as u32 * cells;
        let found: Vec<_> =
            listed.iter().filter(|pair| pair.0 / cells == number as u32).map(|pair| (pair.0 - first, pair.1)).collect();
        let found = compare_sets(&found, &exact);
        assert_eq!((found.recall, found.precision), (1.0, 1.0), "box {number}: {found:?}");
        assert!(found.touching < 0.02, "{found:?}");
    }
}

/// Energy of the indirect light over that of `other`, and mean |difference| over its mean.
fn compared(image: &[[f32; 3]], other: &[[f32; 3]]) -> (f64, f64) {
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
    let apart: f64 = image.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| f64::from((a - b).abs())).sum();
    (sum(image) / sum(other), apart / sum(other))
}

/// The indirect light of the room in a cube of this side about a point.
fn indirect(side: f64, center: &str) -> Vec<[f32; 3]> {
    let stage = room();
    let settings = rays(&[
        &format!("grid.side={side}"),
        &format!("grid.center={center}"),
        "bounces=all",
        "rays.diffuse=32",
        "image.gather_resolution=full",
    ]);
    let options =
        RenderOptions { aovs: vec![Aov::Indirect], ..RenderOptions::new((32, 32), stage.bounds(DVec3::ZERO)) };
    let context = gpu::context();
    let mut renderer = Renderer::new(&context, stage.scene.clone(), &stage.pose(), settings, options).expect("it fits");
    renderer.render(&stage.pose(), &stage.view).expect("a frame");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    renderer.read().get(Aov::Indirect).expect("a layer").to_vec()
}

/// A wall is lit in voxels of three sizes; all of its light reaches all other walls. The voxels, the noise and the
/// regions of shared directions change with the boxes: 3 %. Without the light outside a box, more than half was
/// missing.
#[test]
fn light_crosses_the_borders_of_boxes() {
    let whole = indirect(2.4 * ROOM, "0,0,0");
    for (side, center) in
        [(ROOM, "0,0,0"), (0.3 * ROOM, "0.1,-0.2,0.3"), (0.1 * ROOM, "-0.4,-0.45,-0.4"), (0.3 * ROOM, "camera")]
    {
        let (energy, rel) = compared(&indirect(side, center), &whole);
        assert!((energy - 1.0).abs() < 0.03 && rel < 0.1, "{side} m about {center}: energy {energy}, rel {rel}");
    }
}

/// A room of 4 m with a window that the sun shines through, in a landscape of a kilometre.
fn landscape() -> (Scene, View) {
    let mut scene = Scene::empty("landscape");
    let two_sided = |name: &str, color| Material { double_sided: true, ..Material::lambert(name, color) };
    let grass = scene.add_material(two_sided("grass", Vec3::new(0.2, 0.4, 0.1)));
    let corner = Vec3::new(-500.0, -0.01, -500.0);
    scene.add_mesh(Mesh::quad("ground", grass, corner, Vec3::Z * 1000.0, Vec3::X * 1000.0), DAffine3::IDENTITY);
    let plaster = scene.add_material(two_sided("plaster", Vec3::splat(0.7)));
    let red = scene.add_material(two_sided("red", Vec3::new(0.7, 0.2, 0.2)));
    let mut wall = |material, low: [f32; 3], high: [f32; 3]| {
        scene.add_mesh(Mesh::cuboid("wall", material, low.into(), high.into(), false), DAffine3::IDENTITY);
    };
    wall(plaster, [-2.0, 0.0, -2.0], [2.0, 0.1, 2.0]);
    wall(plaster, [-2.0, 2.5, -2.0], [2.0, 2.7, 2.0]);
    wall(red, [-2.0, 0.0, -2.0], [-1.8, 2.5, 2.0]);
    wall(plaster, [-1.8, 0.0, -2.0], [1.8, 2.5, -1.8]);
    wall(plaster, [-1.8, 0.0, 1.8], [1.8, 2.5, 2.0]);
    // The window takes most of the wall.
    wall(plaster, [1.8, 0.0, -2.0], [2.0, 0.6, 2.0]);
    wall(plaster, [1.8, 2.3, -2.0], [2.0, 2.5, 2.0]);
    let shines = DQuat::from_rotation_arc(DVec3::NEG_Z, DVec3::new(-0.7, -0.6, -0.2).normalize());
    scene.add_light(LightKind::Directional, Vec3::splat(3.0), DAffine3::from_quat(shines));
    (scene, view([1.5, 1.5, 1.5], [-1.5, 1.0, -1.0]))
}

/// 5 %, of which the reference's noise is one: with one grid the walls' light is that of a voxel which holds the whole
/// room.
#[test]
fn a_room_in_a_landscape_is_lit_right_by_default() {
    let (scene, view) = landscape();
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let options =
        Options { width: 32, height: 32, depth: Depth::Full, stop: Stop::Samples(512), seed: 0, occlusion: false };
    let truth = traced::film(&scene, &view, &options).layers(&[Aov::Indirect]);
    let settings = gpu::with(Settings::default(), &["voxels=32", "bounces=all", "image.gather_resolution=full"]);
    let (fitted, words) =
        fitted_to_camera(&settings, Still::new(&scene, &pose, &view), bounds).expect("voxels of 33 m are too large");
    assert!(words.contains("grid.center=camera"), "{words}");
    let context = gpu::context();
    let [found, coarse] = [fitted, settings].map(|settings| {
        let options = RenderOptions { aovs: vec![Aov::Indirect], ..RenderOptions::new((32, 32), bounds) };
        let mut renderer = Renderer::new(&context, scene.clone(), &pose, settings, options).expect("it fits");
        renderer.render(&pose, &view).expect("a frame");
        let layers = renderer.read();
        compared(layers.get(Aov::Indirect).expect("a layer"), truth.get(Aov::Indirect).expect("a layer"))
    });
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    assert!((found.0 - 1.0).abs() < 0.05 && found.1 < 0.12, "{found:?}");
    assert!(coarse.1 > 0.15, "one grid does as well: {coarse:?}");
}

/// Where boxes follow the camera, light of all bounces is copied from the old voxels to the new ones: no frame is
/// darker because light has to settle again. 4 %: other voxels.
#[test]
fn light_goes_on_where_boxes_move() {
    let stage = room();
    let settings =
        rays(&["grid.side=1", "grid.center=camera", "bounces=all", "rays.diffuse=32", "image.gather_resolution=full"]);
    let options =
        RenderOptions { aovs: vec![Aov::Indirect], ..RenderOptions::new((32, 32), stage.bounds(DVec3::ZERO)) };
    let context = gpu::context();
    let mut renderer = Renderer::new(&context, stage.scene.clone(), &stage.pose(), settings, options).expect("it fits");
    // A camera that is turned about the point of its view sees the same surfaces; only the boxes lie differently.
    let look = |eye: [f64; 3]| view(eye, [0.0, 0.0, -0.5]);
    let mean = |renderer: &mut Renderer, view: &View| {
        renderer.render(&stage.pose(), view).expect("a frame");
        let image = renderer.read();
        image.get(Aov::Indirect).expect("a layer").to_vec()
    };
    let near = look([0.5, 0.3, 0.6]);
    mean(&mut renderer, &look([-0.7, -0.6, 0.7]));
    let before = renderer.ground().base().boxes;
    let carried = mean(&mut renderer, &near);
    assert_ne!(renderer.ground().base().boxes, before, "no box moved");
    renderer.forget_light();
    let anew = mean(&mut renderer, &near);
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    let (energy, rel) = compared(&carried, &anew);
    assert!((energy - 1.0).abs() < 0.04 && rel < 0.1, "energy {energy}, rel {rel}");
}
