//! Scenes of the cases with small or smooth details or at the grid's border, each centred at the origin.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

use glam::{DAffine3, DVec3, Vec3};

use super::scenes::{
    add_box, add_lamp, add_matte, add_plaster, add_quad, add_shell, at, room_with, sphere, two_rooms, view, view_of,
};
use super::stage::Stage;
use crate::scene::{LightKind, Material, Mesh, Scene, Transform, View};

/// Kinds of objects that are thinner than a voxel.
pub const THIN: [&str; 4] = ["needles", "slivers", "edge-on quads", "sub-voxel triangles"];

/// Two numbers from 0 to 1 that cover the square evenly (the R2 sequence).
fn spread(i: usize) -> [f32; 2] {
    [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step: f64| (step * i as f64).fract() as f32)
}

/// Triangles of one of [`THIN`] that cover about half of a square metre in the y–z plane; `voxel` is in metres.
fn thin_triangles(kind: &str, voxel: f32) -> Vec<[Vec3; 3]> {
    let point = |i: usize| Vec3::new(0.0, spread(i)[0] - 0.5, spread(i)[1] - 0.5);
    // Each has the same size, rotated in the plane and at another depth.
    let many = |size: [f32; 2]| {
        let count = (1.4 / (size[0] * size[1])).min(20_000.0) as usize;
        let one = |i: usize| {
            let (sin, cos) = (2.4 * i as f32).sin_cos();
            let along = Vec3::new(0.0, cos, sin) * size[0];
            let across = Vec3::new(0.0, -sin, cos) * size[1];
            let corner = point(i) * (1.0 - size[0]) - 0.5 * along + Vec3::X * (0.1 * spread(i + 31)[1] - 0.05);
            [corner, corner + along, corner + across]
        };
        (0..count).map(one).collect::<Vec<_>>()
    };
    let count = (2.0 / voxel) as usize;
    let beside = |i: usize| i as f32 / count as f32 - 0.5;
    match kind {
        "needles" => many([0.3, 0.1 * voxel]),
        "sub-voxel triangles" => many([0.3 * voxel; 2]),
        // Slivers extend from wall to wall, each as wide as the gaps at one end.
        "slivers" => {
            let base = |i: usize| Vec3::new(0.0, -0.5, beside(i));
            (0..count).map(|i| [base(i), base(i) + Vec3::Z * (0.9 / count as f32), base(i) + Vec3::Y]).collect()
        }
        // The quads are like the slats of a blind, half a voxel deep.
        _ => {
            let quad = |i: usize| {
                let a = Vec3::new(-0.25 * voxel, -0.5, beside(i) + 0.5 / count as f32);
                let (u, v) = (Vec3::X * (0.5 * voxel), Vec3::Y);
                [[a, a + u, a + u + v], [a, a + u + v, a + v]]
            };
            (0..count).flat_map(quad).collect()
        }
    }
}

/// Two rooms that thin objects divide, in metres. The objects block the light of the other room, or send the only
/// light.
pub fn thin_screen(kind: &str, voxel_m: f64, sends: bool) -> Stage {
    let (mut stage, mut material) = two_rooms();
    if sends {
        stage.scene.lights.clear();
        let glowing = Material { double_sided: true, ..Material::lamp("glowing", Vec3::splat(5.0)) };
        material = stage.scene.add_material(glowing);
    }
    let triangles = thin_triangles(kind, voxel_m as f32);
    stage.scene.add_mesh(Mesh::triangles("thin", material, &triangles), DAffine3::IDENTITY);
    stage
}

/// A sheet of paper a tenth of a millimetre above a room's floor, seen from close by.
pub fn paper() -> Stage {
    let stage = room_with(|scene| {
        let white = add_plaster(scene, [0.8; 3]);
        add_quad(scene, white, Vec3::new(-0.55, -0.9999, -0.1), [Vec3::Z * 0.42, Vec3::X * 0.3]);
        scene.add_light(LightKind::Point, Vec3::splat(2.0), at(0.2, 0.6, 0.1));
    });
    Stage { view: view([-0.3, -0.5, 0.75], [-0.4, -1.0, 0.1]), ..stage }
}

/// Radiance of the square of [`slope`], its centre, and its half sides along y and z.
const SQUARE: (f64, DVec3, f64) = (0.8 * 3.0 / PI, DVec3::new(-0.8, 0.0, 0.0), 0.3);
const SLOPE_ALBEDO: f64 = 0.7;
/// The slope of the plane of [`slope`] along x, and its height in the middle.
const SLOPE: (f64, f64) = (0.15, -0.5);

/// A plane that rises away from a square which a sun lights uniformly; the sun does not reach the plane's front.
pub fn slope() -> Stage {
    let mut scene = Scene::empty("slope");
    let (white, grey) = (add_matte(&mut scene, [0.8; 3]), add_matte(&mut scene, [SLOPE_ALBEDO as f32; 3]));
    let (_, middle, half) = SQUARE;
    let corner = middle.as_vec3() - Vec3::new(0.0, half as f32, half as f32);
    let side = 2.0 * half as f32;
    add_quad(&mut scene, white, corner, [Vec3::Y * side, Vec3::Z * side]);
    let (rise, height) = (SLOPE.0 as f32, SLOPE.1 as f32);
    let corner = Vec3::new(-0.7, height - 0.7 * rise, -0.7);
    add_quad(&mut scene, grey, corner, [Vec3::Z * 1.4, Vec3::new(1.4, 1.4 * rise, 0.0)]);
    // The view is towards the square.
    scene.add_light(LightKind::Directional, Vec3::splat(3.0), DAffine3::from_rotation_y(FRAC_PI_2));
    let (eye, target) = (DVec3::new(0.0, 1.2, 0.0), DVec3::new(0.0, -0.5, 0.0));
    Stage { scene, reach: 1.2, view: View::look_at(eye, target, DVec3::NEG_Z, 32f32.to_radians()) }
}

/// Radiance of the plane of [`slope`] at the hit point of a ray of its view, with tangents `u` to the right and `v` up
/// (Lambert's formula for polygons).
pub fn slope_radiance(view: &View, [u, v]: [f64; 2]) -> f64 {
    let d = view.forward + view.right() * u + view.up * v;
    let (rise, height) = SLOPE;
    let t = (height + rise * view.eye.x - view.eye.y) / (d.y - rise * d.x);
    let (p, n) = (view.eye + d * t, DVec3::new(-rise, 1.0, 0.0).normalize());
    let (sent, middle, half) = SQUARE;
    let corner = |y: f64, z: f64| (middle + DVec3::new(0.0, y, z) * half - p).normalize();
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let edge = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        a.angle_between(b) * a.cross(b).normalize().dot(n)
    };
    SLOPE_ALBEDO / PI * sent * 0.5 * (0..4).map(edge).sum::<f64>().abs()
}

/// A metal floor with this roughness in front of a wall that ends at its middle and that a sun lights.
pub fn glossy_floor(roughness: f32) -> Stage {
    let mut scene = Scene::empty("glossy floor");
    let metal = scene.add_material(Material { roughness, ..Material::default() });
    let white = add_matte(&mut scene, [0.8; 3]);
    let corner = Vec3::new(-1.0, -0.5, -0.8);
    add_quad(&mut scene, metal, corner, [Vec3::Z * 1.6, Vec3::X * 2.0]);
    add_quad(&mut scene, white, corner, [Vec3::X, Vec3::Y * 1.3]);
    scene.add_light(LightKind::Directional, Vec3::splat(3.0), DAffine3::IDENTITY);
    Stage { scene, reach: 1.4, view: view_of([0.0, 0.3, 1.2], [0.0, -0.5, 0.1], 45.0) }
}

/// Objects of [`glass`] and their indices of refraction.
pub const GLASS: [(&str, f32); 6] = [
    ("slab, ior 1", 1.0),
    ("slab, ior 1.33", 1.33),
    ("slab, ior 1.5", 1.5),
    ("sphere, ior 1.33", 1.33),
    ("sphere, ior 1.5", 1.5),
    ("thin-walled box", 1.5),
];

/// Glowing stripes behind a glass object of [`GLASS`].
pub fn glass(kind: &str, ior: f32) -> Stage {
    let mut scene = Scene::empty("glass");
    let black = add_plaster(&mut scene, [0.0; 3]);
    add_shell(&mut scene, black, [1.0; 3]);
    for i in 0..8 {
        let place = at(-0.84 + 0.24 * f64::from(i), 0.0, -0.97) * DAffine3::from_rotation_x(-FRAC_PI_2);
        let material = scene.add_material(Material::lamp("stripe", Vec3::new(1.0, 0.1 * i as f32, 0.5)));
        let stripe = Mesh::quad("stripe", material, Vec3::new(-0.06, 0.0, -0.9), Vec3::X * 0.12, Vec3::Z * 1.8);
        scene.add_mesh(stripe, place);
    }
    let clear = Material { metallic: 0.0, roughness: 0.0, transmission: 1.0, ior, ..Material::default() };
    // Thin walls are tinted, to show whether their backs, which are single-sided, dim the view.
    let (thickness, tint) = if kind.starts_with("thin") { (0.0, 0.5) } else { (0.2, 1.0) };
    let clear = scene.add_material(Material { thickness, base_color: Vec3::splat(tint).extend(1.0), ..clear });
    if kind.starts_with("sphere") {
        let mut sphere = sphere().scene.meshes.remove(0);
        sphere.material = clear;
        sphere.normals.clone_from(&sphere.positions);
        scene.add_mesh(sphere, at(0.0, 0.0, 0.1) * DAffine3::from_scale(DVec3::splat(0.3)));
    } else {
        add_box(&mut scene, clear, [0.35, 0.35, 0.08], at(0.0, 0.0, 0.1) * DAffine3::from_rotation_y(0.5));
    }
    Stage { scene, reach: SQRT_2, view: view_of([0.0, 0.0, 0.95], [0.0; 3], 40.0) }
}

/// Places of the lamp of [`border_room`].
pub const BORDERS: [&str; 4] = ["on a face", "along an edge", "in a corner", "on a face, a quarter voxel outside"];

/// A room whose walls are the grid's faces, without margin, lit by a lamp at one of [`BORDERS`].
pub fn border_room(kind: &str) -> Stage {
    let stage = room_with(|scene| {
        let (size, place) = match kind {
            "along an edge" => ([1.8, 0.1], at(0.0, 1.0, -0.95)),
            "in a corner" => ([0.1, 0.1], at(0.95, 1.0, 0.95)),
            _ => ([0.4, 0.4], at(0.0, 1.0, 0.0)),
        };
        let lamp = add_lamp(scene, 1.6 / (size[0] * size[1]) as f32, 1.0, place);
        let node = scene.instances[lamp].node;
        // The lamp is just below the ceiling.
        let down = DAffine3::from_translation(DVec3::NEG_Y * 1e-3);
        let scale = DAffine3::from_scale(DVec3::new(size[0], 1.0, size[1]));
        scene.nodes[node].local = Transform::Matrix(down * place * scale);
    });
    Stage { reach: 1.0, ..stage }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_that_fills_the_sky_sends_what_it_has() {
        // Far along the slope the square is a small source with form factor cos cos area / (π d²).
        let stage = slope();
        let view = View { eye: DVec3::new(30.0, 10.0, 0.0), ..stage.view };
        let d = DVec3::new(29.0, SLOPE.1 + 29.0 * SLOPE.0, 0.0) - view.eye;
        let t = d.dot(view.forward);
        let found = slope_radiance(&view, [d.dot(view.right()) / t, d.dot(view.up) / t]);
        let p = view.eye + d;
        let way = SQUARE.1 - p;
        let (n, distance) = (DVec3::new(-SLOPE.0, 1.0, 0.0).normalize(), way.length());
        let expected =
            SLOPE_ALBEDO / PI * SQUARE.0 * 0.36 * (way.dot(n) / distance) * (-way.x / distance) / distance.powi(2);
        assert!((found / expected.abs() - 1.0).abs() < 0.01, "{found} {expected}");
    }

    #[test]
    fn thin_things_cover_about_half() {
        for kind in THIN {
            let triangles = thin_triangles(kind, 0.08);
            let area: f32 = triangles.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum();
            assert!((0.2..1.2).contains(&area), "{kind}: {area}");
        }
    }
}
