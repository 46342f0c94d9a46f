//! The light of list items with the method `rays`: which items stand alone, which are split, and that no light passes a
//! wall.

use crate::gpu;
use crate::more;

use std::collections::BTreeMap;

use crate::studio::{Studio, room};
use glam::{DAffine3, DQuat, DVec3, IVec3, Vec3};
use gpu::twins::split::TrianglePart;
use twobounce::ground::cells::LIT_COUNTS;
use twobounce::ground::layout::{Globals, ItemPart, ListCount, ListItem, Triangle};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Scene, View};
use twobounce::settings::Settings;
use twobounce::stability::case::Place;
use twobounce::stability::cell::settings;
use twobounce::stability::scenes::{DARK, LIT, divided, two_rooms as two_rooms_of_1m, view};
use twobounce::stability::stage::{moved, seen};
use twobounce::vk::download;

const EDGE: u32 = 16;

/// Lists on the device.
struct Held {
    items: Vec<ListItem>,
    parts: Vec<ItemPart>,
    triangles: Vec<Triangle>,
    lit: Vec<u32>,
}

fn held(studio: &Studio) -> Held {
    let (context, ground) = (&studio.context, studio.renderer.ground());
    let lists = ground.base();
    let globals: Vec<Globals> = download(context, &lists.globals).expect("counters");
    let counts: Vec<ListCount> = download(context, &lists.cells.counts).expect("counts");
    let mut items: Vec<ListItem> = download(context, &lists.items).expect("items");
    items.truncate(globals[0].item_count as usize);
    let mut lit: Vec<u32> = download(context, &lists.lit_items).expect("lit items");
    lit.truncate(counts[LIT_COUNTS as usize].count as usize);
    Held {
        items,
        lit,
        parts: download(context, &lists.item_parts).expect("parts"),
        triangles: download(context, &ground.triangles).expect("triangles"),
    }
}

impl Held {
    fn corners(&self, item: usize) -> [DVec3; 3] {
        let triangle = &self.triangles[self.items[item].triangle as usize];
        triangle.corners.map(|v| Vec3::from_array(v).as_dvec3())
    }
}

#[test]
fn an_item_is_alone_where_it_is_lit_for_all_of_its_voxel() {
    let scene = room();
    let mut studio = Studio::new(&scene, &Settings { voxels: EDGE, ..Settings::fast() });
    studio.image(&scene.pose(None, 0.0));
    let held = held(&studio);
    let mut in_voxel: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (item, part) in held.items.iter().zip(&held.parts) {
        in_voxel.entry(item.voxel).or_default().push(part.lit_by);
    }
    let is_alone = |item: u32| in_voxel[&held.items[item as usize].voxel].iter().all(|lit| *lit == item);
    let (alone, others): (Vec<u32>, Vec<u32>) = held.lit.iter().partition(|item| is_alone(**item));
    for (items, flag) in [(&alone, 1), (&others, 0)] {
        assert!(items.iter().all(|item| held.parts[*item as usize].alone == flag));
    }
    assert!(alone.len() > 500 && others.len() > 100, "{} alone, {} with others", alone.len(), others.len());
}

/// The first slot of an item in the index's hash table, as in `glsl/ground/item_index.glsl`.
fn index_place(item: &ListItem, places: usize) -> usize {
    let hash = item.triangle.wrapping_mul(0x9e37_79b1) ^ item.voxel.wrapping_mul(0xb504_f333);
    let hash = (hash ^ (hash >> 15)).wrapping_mul(0x85eb_ca77);
    (hash ^ (hash >> 13)) as usize & (places - 1)
}

#[test]
fn the_index_has_every_item_once_where_a_look_up_finds_it() {
    let scene = lantern(2, DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 0.7, 0.2));
    let mut studio = Studio::new(&scene, &Settings { voxels: EDGE, ..Settings::fast() });
    studio.image(&scene.pose(None, 0.0));
    let held = held(&studio);
    let lists = studio.renderer.ground().base();
    let heads: Vec<u32> = download(&studio.context, &lists.heads).expect("heads");
    let index = &heads[lists.voxels as usize..];
    assert!(index.len().is_power_of_two() && index.len() * 2 >= 3 * held.items.len(), "{} places", index.len());
    let is_twin = |item: usize| held.parts[item].twin as usize == item + 1;
    let listed: Vec<u32> = (0..held.items.len()).filter(|item| !is_twin(*item)).map(|item| item as u32 + 1).collect();
    let mut entered: Vec<u32> = index.iter().copied().filter(|item| *item != 0).collect();
    entered.sort_unstable();
    assert_eq!(entered, listed);
    let mut moved_on = 0;
    for &item in &listed {
        let first = index_place(&held.items[item as usize - 1], index.len());
        let way = (0..).map(|k| index[(first + k) % index.len()]).take_while(|found| *found != 0);
        let before = way.take_while(|found| *found != item).count();
        assert_eq!(index[(first + before) % index.len()], item);
        moved_on += usize::from(before > 0);
    }
    assert!(moved_on > 5, "{moved_on} items stand at another place than their first");
}

#[test]
fn what_another_surface_cuts_is_lit_as_two_as_the_twin_says() {
    for turned in [DQuat::IDENTITY, DQuat::from_rotation_y(0.3), DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 0.7, 0.2)]
    {
        let scene = lantern(2, turned);
        let mut studio = Studio::new(&scene, &Settings { voxels: EDGE, ..Settings::fast() });
        studio.image(&scene.pose(None, 0.0));
        let held = held(&studio);
        let is_twin = |item: usize| held.parts[item].twin as usize == item + 1;
        let mut in_voxel: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for item in (0..held.items.len()).filter(|item| !is_twin(*item)) {
            in_voxel.entry(held.items[item].voxel).or_default().push(item);
        }
        let (mut split, mut whole, mut off) = (0, 0, 0);
        for item in held.lit.iter().map(|item| *item as usize).filter(|item| !is_twin(*item)) {
            let (voxel, part) = (held.items[item].voxel, &held.parts[item]);
            let others = in_voxel[&voxel].iter().filter(|other| held.parts[**other].lit_by as usize != item);
            let others: Vec<_> = others.map(|other| held.corners(*other)).collect();
            let low =
                IVec3::from([voxel % EDGE, voxel / EDGE % EDGE, voxel / EDGE / EDGE].map(|v| v as i32)).as_dvec3();
            let two_sided =
                scene.materials[held.triangles[held.items[item].triangle as usize].material as usize].double_sided;
            let cut = TrianglePart { corners: held.corners(item), center: low + 0.5, two_sided, others: &others };
            if part.area < 1e-4 {
                continue; // its middle is anywhere within rounding
            }
            off += u32::from((part.twin != 0) != cut.is_cut());
            if part.twin == 0 {
                whole += 1;
                continue;
            }
            split += 1;
            let twin = part.twin as usize - 1;
            assert!(is_twin(twin) && held.parts[twin].lit_by as usize == item && held.lit.contains(&(twin as u32)));
            let listed = |item: usize| (held.items[item].voxel, held.items[item].triangle);
            assert_eq!(listed(twin), listed(item));
            let anchors = [item, twin].map(|item| {
                let at = held.parts[item].anchor;
                cut.on_plane([at & 0xffff, at >> 16].map(|v| f64::from(v) / 65535.0 - 0.5))
            });
            off += u32::from(cut.sees(anchors[0], anchors[1]));
        }
        // A cut ends within rounding of a tested point.
        assert!(off * 100 < split + whole, "{turned}: {off} of {} differ", split + whole);
        assert!(split > 20 && whole > 200, "{turned}: {split} are split, {whole} are whole");
    }
}

/// Walls around a light, a quarter voxel thick or without thickness, in a dark room.
fn lantern(kind: usize, turned: DQuat) -> Scene {
    let mut scene = Scene::empty("lantern");
    let walls = scene.add_material(Material::lambert("walls", Vec3::splat(0.8)));
    scene.add_mesh(Mesh::cuboid("room", walls, Vec3::splat(-4.0), Vec3::splat(4.0), true), DAffine3::IDENTITY);
    let sides =
        scene.add_material(Material { double_sided: kind != 1, ..Material::lambert("sides", Vec3::splat(0.8)) });
    let place = DAffine3::from_quat(turned);
    let voxel = 8.0 / (EDGE - 5) as f32; // a margin of 2.5 voxels on each side
    let (inner, thick) = (1.3, 0.25 * voxel);
    match kind {
        // Sheets,
        0 => drop(scene.add_mesh(Mesh::cuboid("sheets", sides, Vec3::splat(-inner), Vec3::splat(inner), false), place)),
        // closed walls of one side,
        1 => {
            let outer = inner + thick;
            scene.add_mesh(Mesh::cuboid("inside", sides, Vec3::splat(-inner), Vec3::splat(inner), true), place);
            scene.add_mesh(Mesh::cuboid("outside", sides, Vec3::splat(-outer), Vec3::splat(outer), false), place);
        }
        // slabs that pierce each other.
        _ => {
            for (axis, sign) in (0..3).flat_map(|axis| [(axis, 1.0_f32), (axis, -1.0)]) {
                let (mut low, mut high) = (Vec3::splat(-1.6), Vec3::splat(1.6));
                let ends = [sign * inner, sign * (inner + thick)];
                (low[axis], high[axis]) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                scene.add_mesh(Mesh::cuboid("slab", sides, low, high, false), place);
            }
        }
    }
    scene.add_light(LightKind::Point, Vec3::splat(20.0), DAffine3::from_translation(DVec3::new(0.2, 0.3, -0.1)));
    scene
}

/// Means over images from within the lantern, and from the room.
fn inside_and_outside(scene: &Scene, settings: &Settings) -> [f64; 2] {
    let context = gpu::context();
    let pose = scene.pose(None, 0.0);
    let options = RenderOptions::new((24, 24), scene.bounds(None));
    let mut renderer = Renderer::new(&context, scene.clone(), &pose, settings.clone(), options).expect("it fits");
    let from = |eye: DVec3| View {
        eye,
        forward: (DVec3::new(0.1, -0.2, 0.05) - eye).normalize(),
        ..View::framing(scene.bounds(None))
    };
    [DVec3::new(0.5, 0.4, 0.6), DVec3::new(3.4, 2.9, 3.2)].map(|eye| {
        renderer.render(&pose, &from(eye)).expect("a frame");
        assert_eq!(context.take_validation_messages(), Vec::<String>::new());
        let image = renderer.read();
        image.beauty().iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * image.beauty().len()) as f64
    })
}

#[test]
fn no_light_comes_through_walls_of_a_quarter_voxel_or_less() {
    let turns = [DQuat::IDENTITY, DQuat::from_rotation_y(0.3), DQuat::from_euler(glam::EulerRot::XYZ, 0.5, 0.7, 0.2)];
    let lanterns = (0..3).flat_map(|kind| turns.map(|turned| (kind, turned)));
    let settings = [Settings::fast(), Settings::default(), Settings::accurate()]
        .into_iter()
        .flat_map(|base| ["bounces=2", "bounces=all"].map(|bounces| (base.clone(), bounces)));
    let settings: Vec<_> = settings.collect();
    let cases = lanterns.flat_map(|lantern| settings.iter().map(move |settings| (lantern, settings)));
    for ((kind, turned), (base, bounces)) in more::every(11, cases) {
        let settings = gpu::with(base.clone(), &["voxels=16", bounces, "rays.passes=2"]);
        let [inside, outside] = inside_and_outside(&lantern(kind, turned), &settings);
        assert!(inside > 0.05, "{inside}: it is lit inside");
        assert!(outside <= 1e-3 * inside, "kind {kind}, {turned}, {bounces}: {outside} of {inside}");
    }
}

/// Places at which light once came through: a strip narrower than the distance of a part's test points took the other
/// side's light, and a sample that the wall hides was lit.
#[test]
fn no_light_comes_through_a_wall_that_stands_askew() {
    let context = gpu::context();
    for (preset, voxels, thick) in
        [("balanced", 32, 0.0), ("balanced", 32, 0.25), ("fast", 32, 0.25), ("balanced", 64, 0.5)]
    {
        let settings = settings(preset, voxels).unwrap();
        let stage = divided(thick * two_rooms_of_1m().0.voxel_m(&settings));
        let options = RenderOptions::new((64, 64), stage.bounds(DVec3::ZERO));
        let pose = stage.pose();
        let voxel_m = stage.voxel_m(&settings);
        let mut renderer = Renderer::new(&context, stage.scene.clone(), &pose, settings, options).unwrap();
        for place in Place::all(9, true) {
            let world = place.world(voxel_m);
            let [dark, lit] = [DARK, LIT].map(|eye| {
                renderer.render(&moved(&pose, &world), &seen(view(eye, [0.0; 3]), &world)).unwrap();
                renderer.read().beauty().iter().map(|p| f64::from(p[0] + p[1] + p[2])).sum::<f64>()
            });
            assert!(dark <= 1e-4 * lit, "{preset}, {thick} of a voxel of {voxels}, {place}: {dark} of {lit}");
        }
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
}
