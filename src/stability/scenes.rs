//! Scenes of the cases, each centred at the origin.

use std::f64::consts::{FRAC_PI_2, SQRT_2};

use glam::{DAffine3, DVec3, Vec3};

use super::stage::Stage;
use crate::scene::{LightKind, Material, Mesh, Scene, View};

/// A view across a room.
pub fn view(eye: [f64; 3], target: [f64; 3]) -> View {
    view_of(eye, target, 80.0)
}

/// A view with this vertical field of view in degrees.
pub fn view_of(eye: [f64; 3], target: [f64; 3], degrees: f32) -> View {
    View::look_at(DVec3::from(eye), DVec3::from(target), DVec3::Y, degrees.to_radians())
}

pub fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// Adds a diffuse material.
pub fn add_matte(scene: &mut Scene, albedo: impl Into<Vec3>) -> usize {
    scene.add_material(Material::lambert("matte", albedo.into()))
}

/// Adds a diffuse and double-sided material, so that a wall is two surfaces.
pub fn add_plaster(scene: &mut Scene, albedo: impl Into<Vec3>) -> usize {
    scene.add_material(Material { double_sided: true, ..Material::lambert("plaster", albedo.into()) })
}

/// Adds a parallelogram.
pub fn add_quad(scene: &mut Scene, material: usize, corner: Vec3, sides: [Vec3; 2]) -> usize {
    scene.add_mesh(Mesh::quad("quad", material, corner, sides[0], sides[1]), DAffine3::IDENTITY)
}

/// Adds a box with its own transform.
pub fn add_box(scene: &mut Scene, material: usize, half: [f32; 3], place: DAffine3) -> usize {
    let half = Vec3::from(half);
    scene.add_mesh(Mesh::cuboid("box", material, -half, half, false), place)
}

/// Adds the inside of a box.
pub fn add_shell(scene: &mut Scene, material: usize, half: [f32; 3]) {
    let half = Vec3::from(half);
    scene.add_mesh(Mesh::cuboid("shell", material, -half, half, true), DAffine3::IDENTITY);
}

/// Adds a square lamp in the x–z plane that shines down; returns its instance.
pub fn add_lamp(scene: &mut Scene, radiance: f32, side: f32, place: DAffine3) -> usize {
    let material = scene.add_material(Material::lamp("lamp", Vec3::splat(radiance)));
    let corner = Vec3::new(-0.5 * side, 0.0, -0.5 * side);
    scene.add_mesh(Mesh::quad("lamp", material, corner, Vec3::X * side, Vec3::Z * side), place)
}

/// Half the side of [`room`] in metres.
pub const ROOM: f64 = 1.0;

/// The view of [`room`].
const IN_ROOM: ([f64; 3], [f64; 3]) = ([-0.3, 0.1, 0.95], [0.0, -0.1, 0.0]);

/// A closed room of grey plaster with a red and a green wall and a block on its floor, lit by a point light. The block
/// is instance 1.
pub fn room() -> Stage {
    room_with(|scene| scene.add_light(LightKind::Point, Vec3::splat(2.0), at(0.2, 0.6, 0.1)))
}

/// The room of [`room`] with another light.
pub fn room_with<T>(light: impl FnOnce(&mut Scene) -> T) -> Stage {
    let mut scene = Scene::empty("room");
    let grey = add_plaster(&mut scene, [0.7; 3]);
    add_shell(&mut scene, grey, [1.0; 3]);
    add_box(&mut scene, grey, [0.3, 0.4, 0.3], at(0.35, -0.6, -0.3));
    for (x, albedo) in [(-0.99f32, [0.7, 0.1, 0.1]), (0.99, [0.1, 0.7, 0.1])] {
        let color = add_plaster(&mut scene, albedo);
        add_quad(&mut scene, color, Vec3::new(x, -0.97, -0.97), [Vec3::Y * 1.94, Vec3::Z * 1.94]);
    }
    light(&mut scene);
    Stage { scene, reach: ROOM * SQRT_2, view: view(IN_ROOM.0, IN_ROOM.1) }
}

/// Views into the dark and the lit room of [`two_rooms`].
pub const DARK: [f64; 3] = [0.95, 0.0, 0.0];
pub const LIT: [f64; 3] = [-0.95, 0.0, 0.0];

/// Two rooms of 1 m, the left one lit, without a dividing wall.
pub fn two_rooms() -> (Stage, usize) {
    let mut scene = Scene::empty("two rooms");
    let grey = add_plaster(&mut scene, [0.7; 3]);
    add_shell(&mut scene, grey, [1.0, 0.5, 0.5]);
    scene.add_light(LightKind::Point, Vec3::splat(1.0), at(-0.5, 0.2, 0.0));
    // √(1² + 0.5²), the farthest corner.
    (Stage { scene, reach: 1.12, view: view(DARK, [0.0; 3]) }, grey)
}

/// [`two_rooms`] with a wall of this thickness in metres; 0 is a sheet.
pub fn divided(thick: f64) -> Stage {
    let (mut stage, grey) = two_rooms();
    let thick = thick as f32;
    // The wall is at a place where no voxel of an aligned grid begins.
    let place = at(0.011, 0.0, 0.0);
    if thick > 0.0 {
        add_box(&mut stage.scene, grey, [0.5 * thick, 0.5, 0.5], place);
    } else {
        let sheet = Mesh::quad("sheet", grey, Vec3::new(0.0, -0.5, -0.5), Vec3::Y, Vec3::Z);
        stage.scene.add_mesh(sheet, place);
    }
    stage
}

/// Two rooms without fronts, divided by a wall of this thickness whose front edge is seen on edge. A lamp lights the
/// left one, and no straight line leads from there into the right one.
pub fn on_edge(thick: f64) -> Stage {
    let mut scene = Scene::empty("two rooms without fronts");
    let grey = add_plaster(&mut scene, [0.7; 3]);
    let mut shell = Mesh::cuboid("shell", grey, Vec3::new(-1.0, -0.5, -0.5), Vec3::new(1.0, 0.5, 0.5), true);
    // Each side has two triangles, and +z is the last side.
    shell.indices.truncate(30);
    scene.add_mesh(shell, DAffine3::IDENTITY);
    add_box(&mut scene, grey, [0.5 * thick as f32, 0.5, 0.5], DAffine3::IDENTITY);
    add_lamp(&mut scene, 10.0, 0.3, at(-0.4, 0.49, 0.0));
    Stage { scene, reach: 1.12, view: views_on_edge()[0] }
}

/// The views of [`on_edge`]: along the wall, from the dark side and from the lit side; near and far; and at a corner of
/// the rooms.
pub fn views_on_edge() -> [View; 5] {
    [
        view_of([0.0, 0.1, 1.2], [0.0, 0.0, 0.0], 60.0),
        view_of([0.15, 0.3, 1.2], [0.0, -0.1, 0.0], 60.0),
        view_of([-0.15, 0.0, 1.2], [0.0, 0.0, 0.0], 60.0),
        view_of([0.02, 0.2, 3.0], [0.0, 0.0, 0.0], 24.0),
        view_of([0.05, 0.1, 1.0], [0.0, -0.5, -0.5], 24.0),
    ]
}

/// A roof with two slopes of this angle in radians and a ridge at the origin along z. A lamp on the left lights one
/// side, and lies below the plane of the other.
pub fn roof(slope: f32) -> Stage {
    let mut scene = Scene::empty("a roof");
    let grey = add_plaster(&mut scene, [0.7; 3]);
    let down = 0.6 * Vec3::new(slope.cos(), -slope.sin(), 0.0);
    let along = Vec3::new(0.0, 0.0, 1.0);
    scene.add_mesh(Mesh::quad("right", grey, -0.5 * along, along, down), DAffine3::IDENTITY);
    let left = Vec3::new(-down.x, down.y, 0.0);
    scene.add_mesh(Mesh::quad("left", grey, left - 0.5 * along, along, -left), DAffine3::IDENTITY);
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(10.0)));
    let high = Vec3::new(0.0, 0.6 * slope.tan(), 0.0);
    let corner = Vec3::new(-0.8, 0.0, -0.3) - 0.5 * high;
    scene.add_mesh(Mesh::quad("lamp", lamp, corner, high, Vec3::new(0.0, 0.0, 0.6)), DAffine3::IDENTITY);
    Stage { scene, reach: 1.0, view: views_of_roof()[0] }
}

/// The views of [`roof`]: from above, from the dark side and from the lit side; near and far.
pub fn views_of_roof() -> [View; 4] {
    [
        view_of([0.01, 1.2, 0.3], [0.0, 0.0, 0.0], 50.0),
        view_of([0.5, 0.7, 0.4], [0.0, 0.0, 0.0], 50.0),
        view_of([-0.4, 0.9, 0.5], [0.0, 0.0, 0.0], 60.0),
        view_of([0.1, 3.0, 0.5], [0.0, 0.0, 0.0], 20.0),
    ]
}

/// [`two_rooms`] with slats as wide as the gaps between them, and half as thick; in metres.
pub fn fenced(width: f64) -> Stage {
    let (mut stage, grey) = two_rooms();
    let count = (0.5 / width) as i32;
    for i in -count..=count {
        let z = 2.0 * width * f64::from(i);
        // The last slats end at the walls.
        let (near, far) = ((z - 0.5 * width).max(-0.5), (z + 0.5 * width).min(0.5));
        if far > near {
            let half = [0.25 * width as f32, 0.5, 0.5 * (far - near) as f32];
            add_box(&mut stage.scene, grey, half, at(0.0, 0.0, 0.5 * (near + far)));
        }
    }
    stage
}

/// Half the height and the width of the opening of [`doorway`] in metres.
pub const DOOR: [f32; 2] = [0.4, 0.2];

/// [`two_rooms`] with a wall of 0.1 m with an opening, and a closed door of 0.06 m in front of it, at this gap in
/// metres. The door is the last instance.
pub fn doorway(gap: f64) -> Stage {
    let (mut stage, grey) = two_rooms();
    let ([high, wide], thick) = (DOOR, 0.05);
    let side = 0.5 * (0.5 - wide);
    for z in [-1.0, 1.0] {
        add_box(&mut stage.scene, grey, [thick, 0.5, side], at(0.0, 0.0, z * f64::from(wide + side)));
    }
    let lintel = 0.5 * (1.0 - 2.0 * high);
    add_box(&mut stage.scene, grey, [thick, lintel, wide], at(0.0, f64::from(0.5 - lintel), 0.0));
    // It slides in front of the wall on the dark side, and overlaps the opening's edges.
    let half = [0.03, 0.5 - lintel + 0.02, wide + 0.02];
    add_box(&mut stage.scene, grey, half, at(0.08 + gap, f64::from(-lintel), 0.0));
    stage
}

/// A closed box whose walls reflect `albedo` and emit radiance 1.
pub fn furnace(albedo: f32) -> Stage {
    let mut scene = Scene::empty("furnace");
    let glowing = add_matte(&mut scene, [albedo; 3]);
    scene.materials[glowing].emissive = Vec3::ONE;
    add_shell(&mut scene, glowing, [0.5; 3]);
    Stage { scene, reach: 0.5 * SQRT_2, view: view([0.1, 0.05, 0.3], [-0.2, -0.1, -0.5]) }
}

/// A wall of this thickness, red in front and black elsewhere, lit from the front. White squares face it at half a
/// metre in front and behind; all lines between them pass through the wall. The view shows the one behind or, from the
/// other side, the one in front.
pub fn back_side(thick: f64) -> Stage {
    let mut scene = Scene::empty("back side");
    let [red, black, white] = [[0.8, 0.02, 0.02], [0.0; 3], [0.8; 3]].map(|albedo| add_matte(&mut scene, albedo));
    let half = 0.5 * thick as f32;
    // The front faces +x; the other sides of the box are black.
    add_quad(&mut scene, red, Vec3::new(half, -0.5, -0.5), [Vec3::Y, Vec3::Z]);
    let corners = [Vec3::new(-half, -0.5, -0.5), Vec3::new(half, 0.5, 0.5)];
    let mut rest = Mesh::cuboid("rest", black, corners[0], corners[1], false);
    // Each side has two triangles, −x and +x first; the front is removed.
    rest.indices.drain(6..12);
    scene.add_mesh(rest, DAffine3::IDENTITY);
    for (x, sides) in [(-0.5, [Vec3::Y, Vec3::Z]), (0.5, [Vec3::Z, Vec3::Y])] {
        add_quad(&mut scene, white, Vec3::new(x, -0.2, -0.2), sides.map(|side| side * 0.4));
    }
    scene.add_light(LightKind::Point, Vec3::splat(1.0), at(0.35, 0.45, 0.0));
    Stage { scene, reach: 0.75, view: behind(true) }
}

/// The view of the square of [`back_side`] behind the wall, or of the one in front.
pub fn behind(behind: bool) -> View {
    let x = if behind { -0.5 } else { 0.5 };
    view_of([0.4 * x, 0.0, 0.0], [x, 0.0, 0.0], 66.0)
}

/// A sphere of radius 1 and albedo ½ under a uniform sky of radiance 1.
pub fn sphere() -> Stage {
    let mut scene = Scene::empty("sphere");
    let grey = add_matte(&mut scene, [0.5; 3]);
    let mut triangles = Vec::new();
    for (sx, sy, sz) in (0..8).map(|i| (i & 1, i >> 1 & 1, i >> 2)) {
        let sign = |bit: i32| 1.0 - 2.0 * bit as f32;
        let [x, y, z] = [Vec3::X * sign(sx), Vec3::Y * sign(sy), Vec3::Z * sign(sz)];
        let outward = (sx + sy + sz) % 2 == 0;
        triangles.push(if outward { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..3 {
        let split = |[a, b, c]: [Vec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    scene.add_mesh(Mesh::triangles("sphere", grey, &triangles), DAffine3::IDENTITY);
    scene.sky = Vec3::ONE;
    Stage { scene, reach: 1.0, view: view_of([1.0, 0.8, 2.6], [0.0; 3], 30.0) }
}

/// A tilted white square lit by a sun, and nothing else.
pub fn lit_square() -> Stage {
    let mut scene = Scene::empty("lit square");
    let white = add_matte(&mut scene, [0.8; 3]);
    let square = Mesh::quad("square", white, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0);
    scene.add_mesh(square, DAffine3::from_rotation_z(0.2) * DAffine3::from_rotation_x(0.35));
    scene.add_light(LightKind::Directional, Vec3::splat(1.0), DAffine3::from_rotation_x(-FRAC_PI_2));
    Stage { scene, reach: SQRT_2, view: view_of([0.0, 2.0, 0.3], [0.0; 3], 40.0) }
}

/// A corridor eight metres long and one metre wide and high, lit at one end, seen from the middle towards the other
/// end.
pub fn corridor() -> Stage {
    let mut scene = Scene::empty("corridor");
    let grey = add_plaster(&mut scene, [0.7; 3]);
    add_shell(&mut scene, grey, [4.0, 0.5, 0.5]);
    scene.add_light(LightKind::Point, Vec3::splat(10.0), at(-3.7, 0.2, 0.0));
    Stage { scene, reach: 4.1, view: view([0.0, 0.0, 0.0], [4.0, -0.2, 0.0]) }
}

/// A room with mirrors as walls, a diffuse block and a lamp.
pub fn mirror_room() -> Stage {
    let mut scene = Scene::empty("mirror room");
    let mirror = Material { roughness: 0.0, base_color: Vec3::splat(0.8).extend(1.0), ..Material::default() };
    let (mirror, grey) = (scene.add_material(mirror), add_plaster(&mut scene, [0.6; 3]));
    add_shell(&mut scene, mirror, [1.0; 3]);
    add_box(&mut scene, grey, [0.3, 0.4, 0.3], at(0.35, -0.6, -0.3));
    add_lamp(&mut scene, 10.0, 0.5, at(0.0, 0.99, 0.0));
    Stage { scene, reach: ROOM * SQRT_2, view: view(IN_ROOM.0, IN_ROOM.1) }
}

/// Kinds of objects on a floor.
pub const STANDING: [&str; 3] = ["a box", "a ball", "a step"];

/// A closed room with a lamp under its ceiling, and one of [`STANDING`] on its floor at −[`ROOM`].
pub fn standing(kind: &str) -> Stage {
    let mut stage = room_with(|scene| add_lamp(scene, 10.0, 0.5, at(0.3, 0.9, 0.2)));
    let scene = &mut stage.scene;
    scene.instances.remove(1); // the block
    let grey = add_plaster(scene, [0.7; 3]);
    match kind {
        "a box" => {
            let place = at(0.0, 0.3 - ROOM, 0.0) * DAffine3::from_rotation_y(0.5);
            add_box(scene, grey, [0.3; 3], place);
        }
        "a ball" => {
            let mut ball = sphere().scene.meshes.remove(0);
            ball.material = grey;
            scene.add_mesh(ball, at(0.0, 0.3 - ROOM, 0.0) * DAffine3::from_scale(DVec3::splat(0.3)));
        }
        _ => {
            add_box(scene, grey, [1.0, 0.05, 0.5], at(0.0, 0.05 - ROOM, -0.5));
        }
    }
    let view = view_of([-0.3, 0.0, 0.9], [0.0, 0.2 - ROOM, 0.0], 60.0);
    Stage { view, ..stage }
}

/// A room under 1024 lamps of 2 cm, which are out of view: each is smaller than a pixel, and directly visible edges
/// would dominate the error.
pub fn thousand_lamps() -> Stage {
    let stage = room_with(|scene| {
        let material = scene.add_material(Material::lamp("lamp", Vec3::splat(5.0)));
        let place = |i: usize| -0.9 + 1.8 * (i as f32 + 0.5) / 32.0;
        let lamp = |i: usize| {
            let [a, b] = [place(i % 32), place(i / 32)];
            let p = |x: f32, z: f32| Vec3::new(a + 0.01 * x, 0.98, b + 0.01 * z);
            let (first, third) = (p(-1.0, -1.0), p(1.0, 1.0));
            [[first, p(1.0, -1.0), third], [first, third, p(-1.0, 1.0)]]
        };
        let lamps: Vec<_> = (0..1024).flat_map(lamp).collect();
        scene.add_mesh(Mesh::triangles("lamps", material, &lamps), DAffine3::IDENTITY);
    });
    // The view is down by 45°, and the image covers 40°.
    Stage { view: view([-0.3, 0.5, 0.95], [0.0, -0.5, 0.0]), ..stage }
}

/// Kinds of triangles that are invisible and must not change anything.
pub const BAD_TRIANGLES: [&str; 4] = ["without area", "needles", "a surface twice", "far outside"];

/// A [`room`] with triangles of one of [`BAD_TRIANGLES`].
pub fn with_bad_triangles(kind: &str) -> Stage {
    let mut stage = room();
    let grey = stage.scene.meshes[stage.scene.instances[1].mesh].material;
    let point = |i: usize| Vec3::new(0.37 * i as f32, 0.71 * i as f32, 0.53 * i as f32).fract() * 1.6 - 0.8;
    let triangle = |i: usize| match kind {
        "without area" if i.is_multiple_of(2) => [point(i); 3],
        "without area" => [point(i), point(i) * 0.5, Vec3::ZERO],
        // Far thinner than any pixel or voxel.
        "needles" => [point(i), point(i + 7), point(i + 7) + Vec3::new(0.0, 1e-7, 0.0)],
        // Half of the block's top.
        "a surface twice" => [Vec3::new(0.05, -0.2, -0.6), Vec3::new(0.05, -0.2, 0.0), Vec3::new(0.65, -0.2, 0.0)],
        _ => [point(i) + 50.0, point(i + 1) + 50.0, point(i + 2) * 1e4 + 2e4],
    };
    let bad: Vec<_> = (0..if kind == "far outside" { 10 } else { 100 }).map(triangle).collect();
    stage.scene.add_mesh(Mesh::triangles("bad", grey, &bad), DAffine3::IDENTITY);
    stage
}
