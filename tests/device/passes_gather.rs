//! Gathered light against references: sampled lamps, rays, directions shared among neighbours, all bounces.

use crate::gpu;

use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use crate::traced::film;
use glam::{DAffine3, DVec3, Vec3};
use gpu::twins::closed_forms;
use twobounce::frame::MOST_SETTLING;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{Metrics, metrics};
use twobounce::reference::cache::Cache;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{
    Alpha, LightKind, LoadOptions, Material, Mesh, Mip, Projection, Scene, Texture, TextureImage, TextureRef, View,
    Wrap, analytic,
};
use twobounce::settings::{Bounces, Settings};
use twobounce::stability::cases;
use twobounce::stability::cell::{self, Cell, Effort};
use twobounce::stability::row::Measured;

/// Few rays per place, shared among neighbours.
fn rays() -> Settings {
    gpu::with(Settings::default(), &["voxels=32", "rays.diffuse=16", "rays.bounce=8"])
}

fn truth(scene: &str, image: &str) -> (Scene, Layers) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/truth").join(scene);
    let scene = Scene::load(&folder.join(format!("{scene}.glb")), &LoadOptions::default()).expect("the scene loads");
    (scene, Layers::read_exr(&folder.join(format!("{image}.exr"))).expect("the image is there").0)
}

/// The image's layer less the reference's direct light, against `full` less the same.
fn indirect(scene: &Scene, settings: &Settings, direct: &Layers, full: &Layers) -> Metrics {
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let context = gpu::context();
    let image = gpu::render_layers(&context, scene, settings, full.width, view, vec![Aov::Direct]).read();
    let less = |a: &[[f32; 3]], b: &[[f32; 3]]| -> Vec<[f32; 3]> {
        a.iter().zip(b).map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).into()).collect()
    };
    let found = less(image.beauty(), image.get(Aov::Direct).expect("asked for"));
    metrics(&found, &less(full.beauty(), direct.beauty()), "indirect light").expect("images of one size")
}

/// The largest distance of a case of stability from its ideal, on a grid of 32³, at one place for each angle.
fn distance(case: &str, preset: &str) -> f64 {
    let (context, cancel) = (gpu::context(), AtomicBool::new(false));
    let folder = tempfile::tempdir().expect("a folder");
    let cell = Cell {
        context: &context,
        cache: &Cache::at(folder.path()),
        settings: cell::settings(preset, 32).expect("a preset"),
        effort: Effort { places: 3, samples: 64, ..Effort::QUICK },
        memory_limit: None,
        cancel: &cancel,
        frame_ms: Rc::default(),
    };
    let case = cases::named(case).expect("a case");
    let samples = case.run(&cell).expect("images");
    gpu::assert_clean(&context);
    Measured::of_samples(case, &samples, &[], 0.0).0.distance
}

/// The dark room is black to the bit: no ray leads there, and gathered pixels share no light across the wall. Without
/// this check of links a pixel has .5 of the lit room's light.
#[test]
fn light_is_not_shared_across_a_wall_that_is_seen_on_edge() {
    for preset in ["fast", "balanced"] {
        assert_eq!(distance("leak-on-edge", preset), 0.0, "{preset}");
    }
}

/// The dark side of a roof is black to the bit: nothing lights it, and it shares no light with the lit side across the
/// ridge.
#[test]
fn light_is_not_shared_across_a_crease() {
    for preset in ["fast", "balanced"] {
        assert_eq!(distance("leak-crease", preset), 0.0, "{preset}");
    }
}

/// Beside objects on a floor, the floor has as much light as the path tracer finds. The tolerance covers light that is
/// gathered at fewer pixels than the image has: `fast` gathers at a sixteenth of them. When lamps' light was shared
/// across shadows, `fast` was at 1.26, and `balanced` at 1.08.
#[test]
fn no_bright_strip_lies_beside_what_stands_on_a_floor() {
    for (preset, most) in [("fast", 0.08), ("balanced", 0.035)] {
        let distance = distance("contact", preset);
        assert!(distance < most, "{preset}: {distance}");
    }
}

#[test]
fn sampled_lamps_give_the_path_traced_direct_light() {
    let (scene, direct) = truth("cornell-area", "direct");
    let view = scene.view(&scene.pose(None, 0.0), 0);
    for (interleave, most) in [(1, 0.02), (4, 0.06)] {
        let shared = format!("image.interleave={interleave}");
        let settings = gpu::with(rays(), &["lights.lamp_points=64", "image.gather_resolution=full", &shared]);
        let layers = vec![Aov::Direct];
        let image = gpu::render_layers(&gpu::context(), &scene, &settings, direct.width, view, layers).read();
        // Without the lamp itself, which is a hundred times brighter than the room: four samples cannot measure its
        // share of a pixel.
        let pairs = image.get(Aov::Direct).expect("asked for").iter().zip(direct.beauty());
        let lit = pairs.filter(|(a, b)| a[0].max(b[0]) < 2.0).map(|(a, b)| (*a, *b));
        let (found, truth): (Vec<_>, Vec<_>) = lit.unzip();
        assert!(truth.len() > direct.beauty().len() * 9 / 10);
        let found = metrics(&found, &truth, "direct").expect("one size");
        // Without sharing: noise of 64 points in penumbrae, lamp and edges once per pixel. With it, shadows' edges are
        // as wide as five of the 64 pixels.
        let right = (found.energy - 1.0).abs() < 0.01 && found.rel < most;
        assert!(right, "interleave {interleave}: energy {}, rel {}", found.energy, found.rel);
    }
}

#[test]
fn rays_give_the_path_traced_indirect_light() {
    for (name, most) in [("cornell-point", 0.10), ("cornell-area", 0.13)] {
        let (scene, direct) = truth(name, "direct");
        let (_, two) = truth(name, if name == "cornell-area" { "depth3" } else { "depth4" });
        // depth3 and depth4 are one and two indirect bounces.
        let bounces = if name == "cornell-area" { Bounces::One } else { Bounces::Two };
        let found = indirect(&scene, &Settings { bounces, ..rays() }, &direct, &two);
        // 256 directions among 16 neighbours, voxels of 1/27 of the room, and an image so small that neighbours are a
        // voxel apart; about the lamp, which hides a part of the ceiling in its own voxels, the tolerance is larger.
        assert!((found.energy - 1.0).abs() < 0.02 && found.rel < most, "{name}: {found:?}");
    }
}

#[test]
fn half_the_gathers_change_little() {
    let (scene, direct) = truth("cornell-point", "direct");
    let (_, two) = truth("cornell-point", "depth4");
    let half = gpu::with(rays(), &["image.gather_resolution=half"]);
    let found = indirect(&scene, &half, &direct, &two);
    // At 64 pixels a gathered one is two voxels wide.
    assert!((found.energy - 1.0).abs() < 0.02 && found.rel < 0.15, "{found:?}");
}

#[test]
fn no_light_is_shared_across_a_step() {
    // A slot in a floor under the open sky: its bottom sees a quarter of the sky, the floor around it all of the sky.
    let (width, depth) = (0.11_f32, 0.22_f32);
    let mut scene = Scene::empty("a slot in a floor");
    let grey = scene.add_material(Material { double_sided: true, ..Material::lambert("grey", Vec3::splat(0.5)) });
    for (x, y, across) in [(-2.0, 0.0, 2.0 - width / 2.0), (width / 2.0, 0.0, 2.0 - width / 2.0), (-2.0, -depth, 4.0)] {
        let floor = Mesh::quad("floor", grey, Vec3::new(x, y, -2.0), Vec3::Z * 4.0, Vec3::X * across);
        scene.add_mesh(floor, DAffine3::IDENTITY);
    }
    scene.sky = Vec3::ONE;
    let projection = Projection::Orthographic { half_height: 0.2, near: 0.01, far: 10.0 };
    let down = View { eye: DVec3::Y, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    for resolution in ["image.gather_resolution=full", "image.gather_resolution=half"] {
        let settings = gpu::with(rays(), &[resolution]);
        let layers = vec![Aov::Ao, Aov::Depth];
        let image = gpu::render_layers(&gpu::context(), &scene, &settings, 32, down, layers).read();
        let layer = |aov| image.get(aov).expect("asked for").iter().map(|p| p[0]);
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for (open, depth) in layer(Aov::Ao).zip(layer(Aov::Depth)) {
            // Pixels that show both are the mean of both.
            if depth < 1.001 {
                above.push(open);
            } else if depth > 1.219 {
                below.push(open);
            }
        }
        assert!(above.len() > 500 && below.len() > 200, "{} above, {} below", above.len(), below.len());
        assert!(above.iter().all(|open| *open > 0.99), "{resolution}: the slot darkens the floor about it");
        let mean = below.iter().sum::<f32>() / below.len() as f32;
        assert!(mean < 0.35, "{resolution}: the floor brightens its slot, {mean}");
    }
}

#[test]
fn an_open_floor_sends_what_the_sky_gives() {
    let mut scene = Scene::empty("open floor");
    let grey = scene.add_material(Material { specular: 0.0, ..Material::lambert("grey", Vec3::splat(0.5)) });
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    scene.sky = Vec3::new(0.5, 1.0, 2.0);
    let projection = Projection::Orthographic { half_height: 1.0, near: 0.01, far: 10.0 };
    let down = View { eye: DVec3::Y, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    let image = gpu::render_from(&gpu::context(), &scene, &rays(), 16, down).read();
    for pixel in image.beauty() {
        let off = Vec3::from(*pixel) / (0.5 * scene.sky) - 1.0;
        assert!(off.abs().max_element() < 0.002, "{pixel:?}");
    }
}

/// A floor under a lamp two metres above it. The lamp is a square cut into `cells`² squares, without a texture or with
/// one whose left half emits.
fn floor_and_lamp(cells: u32, textured: bool) -> Scene {
    let mut scene = Scene::empty("floor and lamp");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    let floor = Mesh::quad("floor", grey, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    let mut lamp = Material { emissive: Vec3::splat(3.0), ..Material::lambert("lamp", Vec3::ZERO) };
    if textured {
        let rgba = vec![255, 255, 255, 255, 0, 0, 0, 255];
        scene.images.push(TextureImage { name: "half".into(), width: 2, height: 1, rgba });
        let wrap = [Wrap::Clamp; 2];
        scene.textures.push(Texture { image: 0, wrap, mag_linear: false, min_linear: false, mip: Mip::None });
        lamp.emissive_texture = Some(TextureRef { texture: 0, uv_set: 0, transform: Default::default() });
    }
    let lamp = scene.add_material(lamp);
    let side = 1.0 / cells as f32;
    for i in 0..cells * cells {
        let corner = Vec3::new(-0.5 + (i % cells) as f32 * side, 2.0, -0.5 + (i / cells) as f32 * side);
        scene.add_mesh(Mesh::quad("lamp", lamp, corner, Vec3::X * side, Vec3::Z * side), DAffine3::IDENTITY);
    }
    scene
}

/// Mean direct light of the floor about `x`, and the value by the form factor of the lamp between x = −0.5 and `end`.
fn lit(scene: &Scene, x: f64, end: f64) -> (f64, f64) {
    let projection = Projection::Orthographic { half_height: 0.05, near: 0.01, far: 10.0 };
    let down = View { eye: DVec3::new(x, 1.0, 0.0), forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    let image = gpu::render_layers(&gpu::context(), scene, &rays(), 16, down, vec![Aov::Direct]).read();
    let direct = image.get(Aov::Direct).expect("asked for");
    let mean = direct.iter().map(|p| f64::from(p[0])).sum::<f64>() / direct.len() as f64;
    let lamp = [(-0.5, -0.5), (end, -0.5), (end, 0.5), (-0.5, 0.5)].map(|(x, z)| DVec3::new(x, 2.0, z));
    let open = closed_forms::ambient_occlusion(DVec3::X * x, DVec3::Y, &lamp);
    (mean, 3.0 * 0.5 * (1.0 - open))
}

#[test]
fn a_lamp_lights_by_its_form_factor_whole_cut_and_textured() {
    for x in [0.0, 1.5] {
        let (one, expected) = lit(&floor_and_lamp(1, false), x, 0.5);
        // Nothing is in shadow, so nothing is noisy. The image's mean over 0.1 m differs from its middle.
        assert!((one / expected - 1.0).abs() < 0.005, "one lamp, {x}: {one} is not {expected}");
        // 512 triangles and 8 points: the mean of 256 pixels, each of 16 candidates from the tree.
        let (many, expected) = lit(&floor_and_lamp(16, false), x, 0.5);
        assert!((many / expected - 1.0).abs() < 0.02, "many lamps, {x}: {many} is not {expected}");
        // Pieces are cut along the triangle, the texture's edge along the square's middle.
        let (half, expected) = lit(&floor_and_lamp(1, true), x, 0.0);
        assert!((half / expected - 1.0).abs() < 0.03, "textured, {x}: {half} is not {expected}");
    }
}

fn furnace(albedo: f32, settings: &Settings) -> (f64, f64, u32) {
    let scene = analytic::furnace(albedo, 1.0, false);
    let pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    let mut renderer = renderer(&scene, settings);
    let settling = renderer.render(&pose, &view).expect("a frame").settling;
    let image = renderer.read();
    let values = image.beauty().iter().flatten().map(|v| f64::from(*v));
    let (sum, most) = values.fold((0.0, 0.0_f64), |(sum, most), v| (sum + v, most.max(v)));
    (sum / (3 * image.beauty().len()) as f64, most, settling)
}

fn renderer(scene: &Scene, settings: &Settings) -> Renderer {
    let options = RenderOptions::new((32, 32), scene.bounds(None));
    Renderer::new(&gpu::context(), scene.clone(), &scene.pose(None, 0.0), settings.clone(), options).expect("it fits")
}

#[test]
fn all_bounces_fill_a_furnace_and_stay_bounded() {
    let all = |settings: Settings| gpu::with(settings, &["voxels=32", "bounces=all", "lights.lamps=gathered"]);
    let cones = gpu::with(Settings::cones(), &["cones.set=g8", "cones.step=1.5"]);
    for settings in [all(rays()), all(cones)] {
        let (mean, most, settling) = furnace(0.8, &settings);
        // The bounds cover the loss of two bounces in corners (see passes_light.rs), bounce after bounce, and f16.
        let right = (0.85..=1.02).contains(&(mean / 5.0)) && most <= 1.03 * 5.0;
        assert!(right && settling < MOST_SETTLING, "{mean} and {most} of 5 after {settling}");
        for albedo in [0.99, 1.0] {
            // At most one emission per bounce: two per frame, and the image's own.
            let (_, most, _) = furnace(albedo, &Settings { voxels: 16, ..settings.clone() });
            let bound = f64::from(2 * (MOST_SETTLING + 2) + 1);
            assert!(most.is_finite() && most <= 1.05 * bound, "{albedo}: {most}, {bound} at most");
        }
    }
}

#[test]
fn a_light_that_goes_leaves_no_long_trail() {
    let (scene, _) = truth("cornell-point", "direct");
    let pose = scene.pose(None, 0.0);
    let view = scene.view(&pose, 0);
    let mut renderer = renderer(&scene, &Settings { bounces: Bounces::All, ..rays() });
    let mut mean = |pose: &_| {
        renderer.render(pose, &view).expect("a frame");
        renderer.read().beauty().iter().flatten().map(|v| f64::from(*v)).sum::<f64>()
    };
    let lit = mean(&pose);
    let mut gone = pose.clone();
    gone.lights[0].position.y += 1e4; // far above the closed ceiling
    let trail: Vec<f64> = (0..8).map(|_| mean(&gone) / lit).collect();
    // Each frame keeps the share of light that one bounce leaves: walls of 0.73, a third of them coloured, and
    // openings.
    assert!(trail.windows(2).all(|w| w[1] < 0.55 * w[0] + 1e-6), "{trail:?}");
    assert!(trail[7] < 0.01, "{trail:?}");
}

/// A rough, dark floor, and at its end a small sunlit wall, a thousand times as bright.
fn floor_before_a_bright_wall() -> (Scene, View) {
    let mut scene = Scene::empty("floor");
    let stone = Material { roughness: 0.8, specular: 1.0, ..Material::lambert("stone", Vec3::splat(0.2)) };
    let stone = scene.add_material(stone);
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    let floor = Mesh::quad("floor", stone, Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    scene.add_mesh(
        Mesh::quad("wall", white, Vec3::new(-0.3, 0.5, -2.0), Vec3::X * 0.6, Vec3::Y * 0.5),
        DAffine3::IDENTITY,
    );
    // The light shines along the floor, on the wall alone.
    scene.add_light(LightKind::Directional, Vec3::splat(50.0), DAffine3::IDENTITY);
    let projection = Projection::Perspective { fov: 0.7, near: 0.01, far: f32::INFINITY };
    let (eye, to) = (DVec3::new(0.0, 2.2, 2.2), DVec3::new(0.0, 0.0, 0.2));
    let forward = (to - eye).normalize();
    (scene, View { eye, forward, up: DVec3::X.cross(forward), projection })
}

#[test]
fn a_rough_floor_has_no_sparks() {
    let (scene, view) = floor_before_a_bright_wall();
    let settings = gpu::with(Settings::default(), &["voxels=32", "bounces=1"]);
    let layers = vec![Aov::Indirect];
    let render = |settings: &Settings| {
        let image = gpu::render_layers(&gpu::context(), &scene, settings, 64, view, layers.clone()).read();
        image.get(Aov::Indirect).expect("asked for").to_vec()
    };
    let found = render(&settings);
    let (depth, stop) = (Depth::Bounces(1), Stop::Samples(1024));
    let options = Options { width: 64, height: 64, depth, stop, seed: 0, occlusion: false };
    let truth = film(&scene, &view, &options).layers(&layers);
    let truth = truth.get(Aov::Indirect).expect("asked for");
    let brightest = |image: &[[f32; 3]]| image.iter().map(|p| p[1]).fold(0.0, f32::max);
    let mean = |image: &[[f32; 3]]| image.iter().map(|p| p[1]).sum::<f32>() / image.len() as f32;
    // One ray in the lobe that meets the wall brings a hundred times as much light as the rest of the floor.
    assert!(brightest(&found) < 1.5 * brightest(truth), "{} of {}", brightest(&found), brightest(truth));
    // The rest of the error is the chance that directions, which are equal all over the floor, meet the wall: 17 % with
    // 14 by 16 of them.
    let ratio = mean(&render(&gpu::with(settings, &["rays.diffuse=64"]))) / mean(truth);
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

/// A room lit by a lamp, and a sheet across it that hides its back: opaque, or blended with an alpha of 1.
fn sheet_in_a_room(alpha: Alpha) -> Scene {
    let mut scene = Scene::empty("a sheet in a room");
    let white = scene.add_material(Material { double_sided: true, ..Material::lambert("white", Vec3::splat(0.7)) });
    let sheet = scene.add_material(Material { alpha, ..Material::lambert("sheet", Vec3::splat(0.5)) });
    let lamp = scene.add_material(Material { emissive: Vec3::splat(10.0), ..Material::lambert("lamp", Vec3::ZERO) });
    scene.add_mesh(Mesh::cuboid("room", white, -Vec3::ONE, Vec3::ONE, true), DAffine3::IDENTITY);
    for (material, corner, u, v) in [
        (sheet, Vec3::new(-0.9, -0.9, -0.5), Vec3::X * 1.8, Vec3::Y * 1.8),
        (lamp, Vec3::new(-0.2, 0.98, 0.2), Vec3::X * 0.4, Vec3::Z * 0.4),
    ] {
        scene.add_mesh(Mesh::quad("quad", material, corner, u, v), DAffine3::IDENTITY);
    }
    scene
}

/// Light is gathered for the nearest blended surface as for the nearest opaque one. Where each pixel gathers for
/// itself, as behind another blended surface, the sheet shows the pattern of its directions.
#[test]
fn a_blended_sheet_gathers_as_an_opaque_one() {
    let view = View::look_at(DVec3::new(0.0, 0.0, 0.9), DVec3::new(0.0, 0.0, -0.5), DVec3::Y, 0.9);
    let settings = gpu::with(Settings::preset("fast").expect("a preset"), &["voxels=32"]);
    let indirect = |scene: &Scene| {
        let image = gpu::render_layers(&gpu::context(), scene, &settings, 64, view, vec![Aov::Indirect]).read();
        image.get(Aov::Indirect).expect("asked for").to_vec()
    };
    let opaque = indirect(&sheet_in_a_room(Alpha::Opaque));
    let apart = |image: &[[f32; 3]]| {
        let squares = image.iter().zip(&opaque).map(|(a, b)| f64::from(a[1] / b[1] - 1.0).powi(2));
        (squares.sum::<f64>() / opaque.len() as f64).sqrt()
    };
    let blended = apart(&indirect(&sheet_in_a_room(Alpha::Blend)));
    // A shadow ray may pass blended and opaque surfaces differently; list items lie at other places of their voxels.
    assert!(blended < 0.02, "{blended}");
}

/// Each gathered pixel represents a square of the image by the light of its middle, wherever its samples are: light of
/// a lamp above has the same height in the image as light that is gathered at every pixel.
#[test]
fn gathered_light_does_not_shift() {
    let view = View::look_at(DVec3::new(0.0, 0.0, 0.9), DVec3::new(0.0, 0.0, -0.5), DVec3::Y, 0.9);
    let scene = sheet_in_a_room(Alpha::Opaque);
    // Pixels below the middle, weighted by their light.
    let height = |changes: &[&str]| {
        let settings = gpu::with(
            rays(),
            &[&["bounces=1", "lights.lamp_points=64", "image.passes=4", "image.interleave=1"], changes].concat(),
        );
        let image = gpu::render_layers(&gpu::context(), &scene, &settings, 64, view, vec![Aov::Direct]).read();
        let light = image.get(Aov::Direct).expect("asked for");
        let moment: f64 = light.iter().enumerate().map(|(i, p)| f64::from(p[1]) * ((i / 64) as f64 - 31.5)).sum();
        moment / light.iter().map(|p| f64::from(p[1])).sum::<f64>()
    };
    let at_pixels = height(&["image.gather_resolution=full", "image.samples=1"]);
    for changes in
        [["image.gather_resolution=quarter", "image.samples=1"], ["image.gather_resolution=full", "image.samples=4"]]
    {
        let off = height(&changes) - at_pixels;
        // Noise of points on the lamp; light that is gathered at samples is shifted by .11 pixels.
        assert!(off.abs() < 0.05, "{changes:?}: {off} pixels");
    }
}
