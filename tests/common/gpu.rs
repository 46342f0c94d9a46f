//! One frame under validation, and its results on the device. Every test file uses a part of this.
#![allow(dead_code)]

#[path = "../twins/mod.rs"]
pub mod twins;

use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};

use half::f16;
use twins::volume::Volume;
use twins::voxelise::Pair;
use twobounce::ground::layout::{Globals, ItemPart, ListItem, Triangle};
use twobounce::ground::volume::LightVolume;
use twobounce::layers::Aov;
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{Scene, View};
use twobounce::settings::{Settings, Tracer};
use twobounce::vk::{Context, ContextOptions, download, download_image};

use glam::Vec4;

/// A device with validation and synchronisation validation on; all tests of a binary share it, so that each pipeline is
/// compiled once.
pub fn context() -> Arc<Context> {
    static SHARED: LazyLock<Arc<Context>> = LazyLock::new(own_context);
    SHARED.clone()
}

/// Shaders of the folder that `TWOBOUNCE_TEST_GLSL` names replace those that the build compiled: `make faults` plants
/// most faults in this way, without a build.
#[cfg(feature = "hot-reload")]
fn take_planted_shaders() {
    static TAKEN: LazyLock<()> = LazyLock::new(|| {
        if let Some(folder) = std::env::var_os("TWOBOUNCE_TEST_GLSL") {
            twobounce::vk::Reload::take_all(folder.as_ref()).expect("the planted shaders");
        }
    });
    LazyLock::force(&TAKEN);
}

#[cfg(not(feature = "hot-reload"))]
fn take_planted_shaders() {}

/// Fails on any error or warning of the validation layer so far.
pub fn assert_clean(context: &Context) {
    let messages = context.validation_messages();
    assert!(messages.is_empty(), "the validation layer says:\n{}", messages.join("\n"));
}

/// A context for one test alone, which counts allocations and objects.
pub fn own_context() -> Arc<Context> {
    take_planted_shaders();
    Context::new(&ContextOptions { validation: true, ..Default::default() }).expect("a device that twobounce can use")
}

/// A context of one test's own in which every shader that can counts its reads.
pub fn counting() -> Arc<Context> {
    take_planted_shaders();
    let options = ContextOptions { validation: true, ..Default::default() };
    Context::counting(&options).expect("a device that twobounce can use")
}

/// A context of one test's own whose driver describes the pipelines, where it can.
pub fn describing() -> Arc<Context> {
    take_planted_shaders();
    let options = ContextOptions { validation: true, ..Default::default() };
    Context::describing(&options).expect("a device that twobounce can use")
}

/// The tracers that a context offers, the tree first. If `TWOBOUNCE_TEST_QUERIES` is set, queries must be among them.
pub fn tracers(context: &Context) -> &'static [Tracer] {
    let asked = std::env::var_os("TWOBOUNCE_TEST_QUERIES").is_some();
    assert!(context.has_ray_queries() || !asked, "{} has no ray queries", context.name);
    if context.has_ray_queries() { &[Tracer::Tree, Tracer::Query] } else { &[Tracer::Tree] }
}

/// Settings with some changed, each `key=value`.
pub fn with(mut settings: Settings, changes: &[&str]) -> Settings {
    changes.iter().for_each(|change| settings.set(change).expect("a setting"));
    settings
}

/// A renderer that has drawn `scene` once, `size` pixels wide and high.
pub fn render(context: &Arc<Context>, scene: &Scene, settings: &Settings, size: u32) -> Renderer {
    render_from(context, scene, settings, size, View::framing(scene.bounds(None)))
}

/// As [`render`], seen through `view`.
pub fn render_from(context: &Arc<Context>, scene: &Scene, settings: &Settings, size: u32, view: View) -> Renderer {
    render_layers(context, scene, settings, size, view, vec![])
}

/// As [`render_from`], with more layers than the image. Any validation message fails.
#[allow(clippy::too_many_arguments, reason = "it is `render_from` with one more choice")]
pub fn render_layers(
    context: &Arc<Context>,
    scene: &Scene,
    settings: &Settings,
    size: u32,
    view: View,
    aovs: Vec<Aov>,
) -> Renderer {
    let pose = scene.pose(None, 0.0);
    let options = RenderOptions { aovs, ..RenderOptions::new((size, size), scene.bounds(None)) };
    let mut renderer =
        Renderer::new(context, scene.clone(), &pose, settings.clone(), options).expect("the scene fits the device");
    renderer.keep_log();
    renderer.render(&pose, &view).expect("a frame");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    renderer
}

/// The listed (voxel, triangle) pairs; a triangle is its index in the scene. The function checks the properties of any
/// lists: the counters match, no list is cyclic, and the cells, where they are kept, are the occupied voxels, each
/// once.
pub fn listed_pairs(context: &Arc<Context>, renderer: &Renderer) -> Vec<Pair> {
    listed_pairs_of(context, renderer, 0)
}

/// As [`listed_pairs`], for a grid other than the base grid.
pub fn listed_pairs_of(context: &Arc<Context>, renderer: &Renderer, grid: usize) -> Vec<Pair> {
    let (ground, resources) = (renderer.ground(), &renderer.ground().lists[grid]);
    let globals: Globals = download(context, &resources.globals).expect("counters")[0];
    let heads: Vec<u32> = download(context, &resources.heads).expect("heads");
    let items: Vec<ListItem> = download(context, &resources.items).expect("items");
    let triangles: Vec<Triangle> = download(context, &ground.triangles).expect("triangles");
    let cells: Vec<u32> = download(context, &resources.cells.cells).expect("cells");
    assert_eq!((globals.triangle_overflow, globals.item_overflow, globals.cell_overflow), (0, 0, 0));
    let mut pairs = Vec::new();
    for (voxel, head) in heads.iter().take(resources.voxels as usize).enumerate() {
        let mut item = *head;
        while item != 0 {
            let ListItem { triangle, next, voxel: of } = items[item as usize - 1];
            assert_eq!(of, voxel as u32);
            pairs.push((voxel as u32, triangles[triangle as usize].source));
            assert!(pairs.len() <= globals.item_count as usize, "a list is cyclic");
            item = next;
        }
    }
    // Twins are in no list. Where no item is split there is room for one part, which stays unwritten.
    let parts: Vec<ItemPart> = download(context, &resources.item_parts).expect("parts");
    let split = parts.len() >= globals.item_count as usize;
    let counted = parts.iter().take(globals.item_count as usize).enumerate().filter(|_| split);
    let twins = counted.filter(|(item, part)| part.twin as usize == item + 1).count();
    assert_eq!(pairs.len() + twins, globals.item_count as usize);
    let occupied: BTreeSet<u32> = pairs.iter().map(|p| p.0).collect();
    assert_eq!(globals.cell_count as usize, occupied.len());
    if let Some(cells) = cells.get(..occupied.len()) {
        assert_eq!(cells.iter().copied().collect::<BTreeSet<_>>(), occupied);
    }
    pairs
}

/// The bits of every texel of a volume: level by level, face by face.
pub fn volume_bits(context: &Arc<Context>, images: &LightVolume) -> Vec<Vec<Vec<[u16; 4]>>> {
    let level = |k: u32| images.images.iter().map(|face| download_image(context, face, k).expect("a level")).collect();
    (0..images.levels).map(level).collect()
}

/// A volume in the form of its twin.
pub fn volume(context: &Arc<Context>, images: &LightVolume) -> Volume {
    let texel = |bits: &[u16; 4]| Vec4::from_array(bits.map(|b| f16::from_bits(b).to_f32()));
    let levels = volume_bits(context, images);
    let face = |face: &Vec<[u16; 4]>| face.iter().map(texel).collect();
    Volume::new(levels.iter().map(|l| std::array::from_fn(|k| face(&l[k]))).collect())
}
