//! Light on demand: an item is lit where something reads its light, and then has the light that it has where all items
//! are lit.

use crate::gpu;
use crate::more;

use std::collections::BTreeMap;

use crate::scenes::{Random, add, triangle};
use crate::studio::{Studio, asset, moved_poses, room};
use glam::{DVec3, Vec3};
use twobounce::gi::rays::inspect::{Inspect, Inspected};
use twobounce::ground::layout::{Globals, ItemLight, ItemPart, ListItem};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{Bounds, Material, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{download, upload_into};

/// The bits of an item that the first and the second bounce light: `ASKED_FIRST` and `ASKED_SECOND` in
/// `glsl/ground/ask.glsl`.
const ASKED: [u32; 2] = [1, 2];

/// Voxel, triangle and whether it is a twin: this identifies an item in every list.
type ItemKey = (u32, u32, bool);

/// From within the room.
fn within(bounds: Bounds) -> View {
    View { eye: DVec3::new(4.0, 4.0, 0.5), forward: DVec3::Z, up: DVec3::Y, ..View::framing(bounds) }
}

/// The light of the items that the last bounce lit, after an image of `size`.
fn lit(scene: &Scene, settings: &Settings, size: (u32, u32)) -> BTreeMap<ItemKey, ([u32; 6], u32)> {
    let context = gpu::context();
    let (posed, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let options = RenderOptions::new(size, bounds);
    let mut renderer = Renderer::new(&context, scene.clone(), &posed, settings.clone(), options).expect("it fits");
    let view = if scene.cameras.is_empty() { within(bounds) } else { scene.view(&posed, 0) };
    renderer.render(&posed, &view).expect("a frame");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    let lists = renderer.ground().base();
    let globals: Vec<Globals> = download(&context, &lists.globals).expect("counters");
    let items: Vec<ListItem> = download(&context, &lists.items).expect("items");
    let parts: Vec<ItemPart> = download(&context, &lists.item_parts).expect("parts");
    let lights: Vec<ItemLight> = download(&context, &lists.item_lights).expect("lights");
    let asked: Vec<u32> = download(&context, &lists.asked_items).expect("flags");
    let is_lit = |item: &usize| asked[*item] & ASKED[settings.bounces.stored() as usize - 1] != 0;
    let light = |item: usize| {
        let ItemLight { front, back, area, .. } = lights[item];
        let sides = [front, back].concat().try_into().expect("six channels");
        let sides: [f32; 6] = sides;
        let twin = parts[item].twin as usize == item + 1;
        ((items[item].voxel, parts[item].source, twin), (sides.map(f32::to_bits), area.to_bits()))
    };
    (0..globals[0].item_count as usize).filter(is_lit).map(light).collect()
}

#[test]
fn items_that_are_asked_for_have_the_light_that_they_have_where_all_are_lit() {
    for (scene, bounces) in more::every(2, [(asset("gallery.glb"), "bounces=2"), (room(), "bounces=1")]) {
        let settings = gpu::with(Settings::fast(), &["voxels=64", bounces]);
        let (asked, all) = (lit(&scene, &settings, (16, 12)), lit(&scene, &settings, (192, 144)));
        assert!(asked.len() > 100 && asked.len() * 3 < all.len(), "{} of {} are lit", asked.len(), all.len());
        let off = asked.iter().filter(|(key, light)| all.get(key) != Some(light)).count();
        assert_eq!(off, 0, "{off} of {} have another light", asked.len());
    }
}

/// Items that nothing asks for are dark, so an image that read one would change when it is lit.
#[test]
fn an_image_stays_once_everything_is_lit() {
    let scene = asset("gallery.glb");
    let posed = scene.pose(None, 0.0);
    let settings = gpu::with(Settings::fast(), &["voxels=64"]);
    let mut studio = Studio::new(&scene, &settings);
    studio.view = scene.view(&posed, 0);
    let (asked, _) = studio.image(&posed);
    let frame = studio.renderer.frame();
    let frame = || Inspected { ground: &frame.ground, method: &*frame.method };
    let inspect = Inspect::new(&studio.context, &settings, frame()).expect("passes");
    inspect.kept(&studio.context, frame(), (16, 16)).expect("what is kept");
    let (all, _) = studio.image(&posed);
    assert!(asked == all, "{} values differ", asked.iter().zip(&all).filter(|(a, b)| a != b).count());
}

#[test]
fn frames_that_light_what_comes_into_view_are_those_that_start_anew() {
    let scene = room();
    let [here, there, moved] = moved_poses(&scene);
    let settings = gpu::with(Settings::fast(), &["voxels=64"]);
    let mut kept = Studio::new(&scene, &settings);
    let first_view = within(scene.bounds(None));
    let other_view = View { eye: DVec3::new(3.0, 4.5, 1.0), forward: DVec3::NEG_X, ..first_view };
    let frames =
        [(&here, first_view), (&here, other_view), (&there, other_view), (&moved, other_view), (&moved, first_view)];
    for (number, (pose, view)) in frames.into_iter().enumerate() {
        let mut fresh = Studio::new(&scene, &settings);
        (kept.view, fresh.view) = (view, view);
        let (image, passes) = kept.image(pose);
        assert!(passes.contains(&"ask 2"), "frame {number} asks for nothing: {passes:?}");
        assert!(image == fresh.image(pose).0, "frame {number} is another");
    }
}

/// A view in the opposite direction.
fn turned(view: View) -> View {
    View { forward: -view.forward, ..view }
}

/// With all bounces every item is lit, whatever the view: in its first frame a camera that turns around finds the light
/// that a camera with that view from the start finds, also after objects and lights behind it moved.
#[test]
fn with_all_bounces_what_comes_into_view_is_lit_in_its_first_frame() {
    let (gallery, room) = (asset("gallery.glb"), room());
    let still = gallery.pose(None, 0.0);
    let in_gallery = View { eye: gallery.bounds(None).center(), ..gallery.view(&still, 0) };
    let poses = moved_poses(&room).to_vec();
    for (scene, there, poses) in
        more::every(2, [(&room, within(room.bounds(None)), poses), (&gallery, in_gallery, vec![still])])
    {
        let settings = gpu::with(Settings::fast(), &["voxels=32", "bounces=all", "rays.passes=2"]);
        let [mut turns, mut stands] = [(); 2].map(|()| Studio::of_size(scene, &settings, 96));
        stands.view = there;
        for (number, pose) in poses.iter().enumerate() {
            turns.view = turned(there);
            let (behind, _) = turns.image(pose);
            let (before, _) = stands.image(pose);
            assert!(behind != before, "pose {number}: both look the same way");
            turns.view = there;
            let (found, passes) = turns.image(pose);
            let (whole, _) = stands.image(pose);
            let off = found.iter().zip(&whole).filter(|(a, b)| a != b).count();
            assert_eq!(off, 0, "pose {number}: so many of {} values differ; {passes:?}", whole.len());
        }
    }
}

/// A mirror behind a mirror shows direct light, also of glass, which stores none: the memory's earlier content must not
/// come into the image.
#[test]
fn mirrors_show_no_light_that_nothing_wrote() {
    let (context, scene) = (gpu::context(), asset("gallery.glb"));
    let (pose, settings) = (scene.pose(None, 0.0), gpu::with(Settings::default(), &["voxels=32"]));
    let view = scene.view(&pose, 0);
    let mut renderer = gpu::render_from(&context, &scene, &settings, 96, view);
    let first = renderer.read().beauty().to_vec();
    let light = &renderer.ground().base().direct_light;
    upload_into(&context, light, &vec![f32::NAN; light.bytes() as usize / size_of::<f32>()]).expect("an upload");
    renderer.make_anew();
    renderer.render(&pose, &view).expect("a frame");
    assert!(renderer.read().beauty() == first, "the light that was there before is in the image");
    gpu::assert_clean(&context);
}

/// Loose triangles in the room, most of which are a pixel or two wide.
fn cloud() -> Scene {
    let (mut scene, mut random) = (room(), Random::new(3));
    let loose: Vec<_> = (0..20_000)
        .map(|_| {
            let center = random.point() * 7.0 + 0.5;
            triangle(&mut random, center, 0.3)
        })
        .collect();
    add(&mut scene, &loose, Material { double_sided: true, ..Material::lambert("loose", Vec3::splat(0.5)) });
    scene
}

/// Pixels among crumbs take a quarter of the rays. An image of a cloud therefore lights few of its items, and in the
/// mean of its pixels it is as bright as one with all rays.
#[test]
fn a_cloud_of_loose_triangles_lights_a_part_of_its_items_and_loses_no_light() {
    let scene = cloud();
    let pose = scene.pose(None, 0.0);
    let image = |rays: &str| {
        let mut studio =
            Studio::of_size(&scene, &gpu::with(Settings::fast(), &["voxels=64", "image.passes=12", rays]), 64);
        studio.view = within(scene.bounds(None));
        let (image, passes) = studio.image(&pose);
        assert!(passes.contains(&"ask 2"), "light is made on demand: {passes:?}");
        let lists = studio.renderer.ground().base();
        let globals: Vec<Globals> = download(&studio.context, &lists.globals).expect("counters");
        let asked: Vec<u32> = download(&studio.context, &lists.asked_items).expect("flags");
        let items = globals[0].item_count as usize;
        let lit = asked[..items].iter().filter(|asked| **asked & ASKED[1] != 0).count();
        let mean = image.iter().map(|bits| f64::from(f32::from_bits(*bits))).sum::<f64>() / image.len() as f64;
        (lit as f64 / items as f64, mean)
    };
    let ((few, dim), (many, bright)) = (image("rays.diffuse=9"), image("rays.diffuse=36"));
    assert!(few < 0.25 && many > 1.5 * few, "{few} and {many} of the items are lit for the image");
    // The noise of 12 passes over 64² pixels, of which some see an item close to a light.
    assert!((dim / bright - 1.0).abs() < 0.04, "{dim} for {bright}");
}
