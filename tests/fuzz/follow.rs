//! Steps after the loading of a scene, on the processor, up to the data for a device: none may panic, whatever the
//! scene.

use std::sync::atomic::AtomicBool;

use glam::{DAffine3, Vec3};
use twobounce::Error;
use twobounce::frame::{FrameDesc, first_plan};
use twobounce::ground::expected_items::expected_items;
use twobounce::ground::grid::{Grid, radiance_scale};
use twobounce::ground::grid_choice::for_camera;
use twobounce::ground::lamps::Lamps;
use twobounce::ground::scene_on_gpu::ScenePacked;
use twobounce::ground::uniforms::{self, FrameUniforms};
use twobounce::layers::{Aov, Layers};
use twobounce::output::exr;
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, cache, lights_itself, render};
use twobounce::scene::{Material, Mesh, Pose, Scene, Still, View};
use twobounce::settings::{PRESETS, Settings};
use twobounce::stability::warnings::known_failures;

/// Larger scenes are valid and take long, which is no fault: only cheap steps follow for them.
const MOST_TRIANGLES: usize = 20_000;
const MOST_TEXELS: usize = 1 << 20;

/// Takes the steps of `twobounce render` and `reference`. `choice` selects animation, camera, preset and slower steps.
pub fn scene(mut scene: Scene, choice: u64) {
    let some = |count: usize, bits: u32| (count > 0).then(|| (choice >> bits) as usize % count);
    let animation = some(scene.animations.len(), 0);
    let mut pose = scene.pose(animation, 0.0);
    for time_s in [0.3, -1.0, 1e30] {
        pose = scene.pose(animation, time_s);
    }
    let bounds = scene.bounds(animation);
    let view = match some(scene.cameras.len(), 8) {
        Some(camera) => scene.view(&pose, camera),
        None => View::framing(bounds),
    };
    assert!(view.forward.is_normalized() && view.up.is_normalized(), "the view {view:?} has no axes");
    scene.degenerate_triangles(&pose);
    let texels: usize = scene.images.iter().map(|image| image.rgba.len() / 4).sum();
    if scene.triangle_count() > MOST_TRIANGLES || texels > MOST_TEXELS {
        return;
    }
    if scene.emits() && choice >> 16 & 7 == 0 {
        let _ = lights_itself(&scene, &pose, &view);
    }
    if !scene.has_light() {
        scene.add_studio(&view, scene.bounds(None), true);
        pose = scene.pose(animation, 0.0);
    }
    let settings = (PRESETS[(choice >> 24) as usize % PRESETS.len()].settings)();
    device(Still::new(&scene, &pose, &view), &settings);
    trace(&scene, &pose, &view);
}

/// Takes the steps before a device with these settings, on a valid scene.
pub fn settings(settings: &Settings) {
    let mut scene = Scene::empty("quad");
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    scene.add_mesh(Mesh::quad("quad", lamp, Vec3::ZERO, Vec3::X, Vec3::Y), DAffine3::IDENTITY);
    device(Still::new(&scene, &scene.pose(None, 0.0), &View::framing(scene.bounds(None))), settings);
}

/// Makes the data for a device, and plans its memory.
fn device(Still { scene, pose, view }: Still, settings: &Settings) {
    let bounds = scene.bounds(None);
    let packed = ScenePacked::new(scene, pose);
    packed.plan();
    let trees = packed.trees.of_scene(scene);
    trees.top(&pose.world_from_instance);
    let desc = FrameDesc { scene, settings, size: (4, 4), outputs: 1, bounds, slots: 1, query: None, waits: false };
    first_plan(&desc, &packed.trees)(16);
    known_failures(scene, pose, bounds, settings);
    for_camera(settings, Still::new(scene, pose, view), bounds);
    let Ok(grid) = Grid::place(bounds, settings) else { return };
    expected_items(scene, &pose.world_from_instance, &grid);
    let lamps = Lamps::new(scene).place(scene, pose, &grid, settings.lights.lamp_points).sums();
    uniforms::lights(scene, pose, &grid);
    let scale = radiance_scale(scene, grid.voxel_m, settings.bounces);
    let size = (4, 4);
    FrameUniforms {
        scene,
        view,
        grid: &grid,
        scale,
        size,
        samples: 1,
        time_s: 0.0,
        lamps,
        light_pass: 0,
        light_share: 1.0,
        image_pass: 0,
        boxes: Default::default(),
    }
    .layout();
}

/// Path-traces an image of 4 × 4 pixels, and writes its file.
pub fn trace(scene: &Scene, pose: &Pose, view: &View) {
    let (width, height) = (4, 4);
    let options = Options { width, height, depth: Depth::Full, stop: Stop::Samples(1), seed: 1, occlusion: true };
    cache::key(Still::new(scene, pose, view), &options);
    let (mut film, never) = (Film::new(width, height), AtomicBool::new(false));
    let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
    match render(Still::new(scene, pose, view), &options, &mut film, control) {
        Ok(()) => {}
        // An animation may move nodes out of the range of numbers.
        Err(Error::Usage(said)) if pose.check(scene).is_err() => return assert!(said.contains("not finite"), "{said}"),
        Err(error) => panic!("{error}"),
    }
    layers(&film.layers(Aov::ALL));
}

/// Writes layers and reads them again.
fn layers(layers: &Layers) {
    let bytes = exr::encode(layers, &exr::Metadata::new()).expect("a small image can be written");
    exr::decode(&bytes).expect("what was written can be read");
}
