//! The light of list items with the method `rays`: what neighbours share, against a twin, and that nothing comes through a wall.

use crate::gpu;
use crate::more;

use std::collections::BTreeMap;

use crate::studio::{Studio, room};
use glam::{DAffine3, DQuat, DVec3, IVec3, Vec3};
use gpu::twins::alike::facing_cell;
use gpu::twins::split::Part;
use twobounce::ground::cells::LIT_COUNTS;
use twobounce::ground::layout::{Globals, ItemLight, ItemPart, ListCount, ListItem, Triangle};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LightKind, Material, Mesh, Scene, View};
use twobounce::settings::Settings;
use twobounce::stability::case::Place;
use twobounce::stability::cell::settings;
use twobounce::stability::scenes::{DARK, LIT, divided, two_rooms as two_rooms_of_1m, view};
use twobounce::stability::stage::{moved, seen};
use twobounce::vk::download;

const EDGE: u32 = 16;

/// What the device holds of the lists.
struct Held {
    items: Vec<ListItem>,
    heads: Vec<u32>,
    parts: Vec<ItemPart>,
    triangles: Vec<Triangle>,
    sent: Vec<ItemLight>,
    seen: Vec<ItemLight>,
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
        heads: download(context, &lists.heads).expect("heads"),
        parts: download(context, &lists.item_parts).expect("parts"),
        triangles: download(context, &ground.triangles).expect("triangles"),
        sent: download(context, &lists.item_lights).expect("lights"),
        seen: download(context, &lists.seen_lights).expect("lights"),
    }
}

impl Held {
    /// Unit normal and offset of an item's plane, voxels.
    fn plane(&self, item: usize) -> (DVec3, f64) {
        let [a, b, c] = self.corners(item);
        let n = (b - a).cross(c - a).normalize();
        (n, n.dot(a))
    }

    fn corners(&self, item: usize) -> [DVec3; 3] {
        let triangle = &self.triangles[self.items[item].triangle as usize];
        triangle.corners.map(|v| Vec3::from_array(v).as_dvec3())
    }

    fn facing(&self, item: usize) -> (i32, [i32; 2]) {
        let [a, b, c] = self.corners(item);
        facing_cell((b - a).cross(c - a))
    }

    /// Whether no voxel between two points lists more than one surface: every voxel that the way passes for more than rounding.
    fn undivided_between(&self, from: DVec3, to: DVec3) -> bool {
        let crossing = |axis: usize| {
            let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
            let planes = (low.floor() as i32 + 1)..=(high.ceil() as i32 - 1);
            planes.map(move |plane| (f64::from(plane) - from[axis]) / (to[axis] - from[axis]))
        };
        let mut at: Vec<f64> = (0..3).flat_map(crossing).chain([0.0, 1.0]).collect();
        at.sort_by(f64::total_cmp);
        at.windows(2).filter(|part| part[1] - part[0] > 1e-6).all(|part| {
            let voxel = from.lerp(to, 0.5 * (part[0] + part[1])).floor().as_ivec3();
            let voxel = voxel.clamp(IVec3::ZERO, IVec3::splat(EDGE as i32 - 1));
            let head = self.heads[(voxel.x + EDGE as i32 * (voxel.y + EDGE as i32 * voxel.z)) as usize];
            head == 0 || self.parts[self.parts[head as usize - 1].lit_by as usize].alone != 0
        })
    }

    /// What others see of a lit item's front and back, and of how many neighbours that is the mean.
    fn shared(&self, item: usize) -> ([DVec3; 2], u32) {
        let light = |item: usize| {
            let light = &self.sent[item];
            let side = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
            ([side(light.front), side(light.back)], f64::from(light.area))
        };
        let (own, area) = light(item);
        if self.parts[item].alone == 0 || area == 0.0 {
            return (own, 0);
        }
        let (n, offset) = self.plane(item);
        let voxel = self.items[item].voxel;
        let middle = |v: IVec3| v.as_dvec3() + 0.5;
        let here = middle(IVec3::from([voxel % EDGE, voxel / EDGE % EDGE, voxel / EDGE / EDGE].map(|v| v as i32)));
        let axis = (0..3).fold(0, |best, k| if n[k].abs() > n[best].abs() { k } else { best });
        let mut from = here;
        from[axis] += (offset - n.dot(from)) / n[axis];
        let (mut sum, mut total, mut count) = (own.map(|v| v * area), area, 0);
        for (u, v) in (-2..=2).flat_map(|v| (-2..=2).map(move |u| (u, v))).filter(|step| *step != (0i32, 0i32)) {
            // Four steps along each axis count in all, as many as directions differ within: the outer two half.
            let weight = [u, v].map(|step| if step.abs() == 2 { 0.5 } else { 1.0 }).iter().product::<f64>();
            let mut there = here;
            there[(axis + 1) % 3] += f64::from(u);
            there[(axis + 2) % 3] += f64::from(v);
            there[axis] += (offset - n.dot(there)) / n[axis];
            let to = there;
            let there = there.floor().as_ivec3();
            if there.min_element() < 0 || there.max_element() >= EDGE as i32 {
                continue;
            }
            let head = self.heads[(there.x + EDGE as i32 * (there.y + EDGE as i32 * there.z)) as usize];
            if head == 0 {
                continue;
            }
            let neighbour = self.parts[head as usize - 1].lit_by as usize;
            let (m, other) = self.plane(neighbour);
            let material = |item: usize| self.triangles[self.items[item].triangle as usize].material;
            let apart = (n.dot(middle(there)) - offset - m.dot(middle(there)) + other).abs();
            let same = self.facing(neighbour) == self.facing(item) && material(neighbour) == material(item);
            let beside = self.parts[neighbour].alone != 0;
            if beside && same && apart < 0.5 && self.undivided_between(from, to) {
                let (sides, part) = light(neighbour);
                sum = std::array::from_fn(|k| sum[k] + weight * part * sides[k]);
                total += weight * part;
                count += 1;
            }
        }
        (sum.map(|v| v / total), count)
    }
}

#[test]
fn neighbours_share_what_they_send_as_their_twin_says() {
    let scene = room();
    let mut studio = Studio::new(&scene, &Settings { voxels: EDGE, ..Settings::fast() });
    studio.image(&scene.pose(None, 0.0));
    let held = held(&studio);
    let mut in_voxel: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (item, part) in held.items.iter().zip(&held.parts) {
        in_voxel.entry(item.voxel).or_default().push(part.lit_by);
    }
    let (mut sharing, mut alone, mut off) = (0, 0, 0);
    for &item in &held.lit {
        let item = item as usize;
        let of_voxel = &in_voxel[&held.items[item].voxel];
        assert_eq!(held.parts[item].alone != 0, of_voxel.iter().all(|lit| *lit as usize == item));
        let (expected, neighbours) = held.shared(item);
        let found = [held.seen[item].front, held.seen[item].back].map(|v| Vec3::from_array(v).as_dvec3());
        // Where a plane passes a voxel's border within rounding, f32 and f64 may take other neighbours: a few of thousands.
        let same =
            (0..2).all(|k| (found[k] - expected[k]).abs().max_element() <= 1e-4 * expected[k].max_element() + 1e-6);
        off += u32::from(!same);
        alone += u32::from(neighbours == 0);
        sharing += u32::from(neighbours >= 5);
    }
    assert!(off * 500 < held.lit.len() as u32, "{off} of {} differ", held.lit.len());
    assert!(sharing > 500 && alone > 100, "{sharing} share, {alone} do not");
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
            let cut = Part { corners: held.corners(item), center: low + 0.5, two_sided, others: &others };
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
        // Where a cut ends within rounding of a point that is tried.
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
    for ((kind, turned), (base, bounces)) in more::every(5, cases) {
        let settings = gpu::with(base.clone(), &["voxels=16", bounces, "rays.passes=2"]);
        let [inside, outside] = inside_and_outside(&lantern(kind, turned), &settings);
        assert!(inside > 0.05, "{inside}: it is lit inside");
        assert!(outside <= 1e-3 * inside, "kind {kind}, {turned}, {bounces}: {outside} of {inside}");
    }
}

/// Places at which light came through: neighbours shared it through a voxel that a slanting plane passes between theirs, a strip
/// narrower than the points that a part is looked over by took the other side's, and a sample hidden by the wall was lit.
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
