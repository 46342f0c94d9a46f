//! Scenes that are difficult for specular, refraction, shadow and occlusion cones, one subject each. Lengths are in
//! metres.

use std::collections::HashMap;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use twobounce::scene::{LightKind, Material, Mesh, Scene, View};

/// Roughness of the spheres of [`spheres`], row by row from the upper left.
const ROUGHNESSES: [f32; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];
/// Centres (x, y) of the spheres of [`spheres`], and their radius.
pub const SPHERES: [[f64; 2]; 6] = [[-0.6, 0.35], [0.0, 0.35], [0.6, 0.35], [-0.6, -0.35], [0.0, -0.35], [0.6, -0.35]];
pub const SPHERE_RADIUS: f64 = 0.27;
/// Centre and radius of the ball of [`glass_ball`].
pub const BALL: Vec3 = Vec3::new(0.0, 0.0, 0.4);
pub const BALL_RADIUS: f32 = 0.6;

/// Adds a board of `count`² squares of two colours over the parallelogram [`corner`, `u`, `v`].
fn checkerboard(scene: &mut Scene, [corner, u, v]: [Vec3; 3], count: usize, albedos: [Vec3; 2]) {
    let colors = albedos.map(|albedo| scene.add_material(Material::lambert("square", albedo)));
    for i in 0..count * count {
        let (x, y) = (i % count, i / count);
        let (du, dv) = (u / count as f32, v / count as f32);
        let mesh = Mesh::quad("square", colors[(x + y) % 2], corner + du * x as f32 + dv * y as f32, du, dv);
        scene.add_mesh(mesh, DAffine3::IDENTITY);
    }
}

/// A sphere around the origin with smooth normals: an icosahedron whose edges are halved `subdivisions` times. It has
/// 20 · 4ⁿ triangles, and its vertices lie on the sphere.
pub fn sphere(material: usize, radius: f32, subdivisions: u32) -> Mesh {
    let (mut directions, mut triangles) = icosahedron();
    for _ in 0..subdivisions {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                directions.len() as u32 - 1
            })
        };
        let quarter = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(quarter).collect();
    }
    let (normals, count): (Vec<Vec3>, usize) = (directions.iter().map(|d| d.as_vec3()).collect(), directions.len());
    Mesh {
        name: "sphere".into(),
        positions: normals.iter().map(|&n| n * radius).collect(),
        normals,
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); count],
        uvs: [vec![Vec2::ZERO; count], vec![Vec2::ZERO; count]],
        colors: vec![Vec4::ONE; count],
        indices: triangles.into_iter().flatten().collect(),
        material,
        ..Mesh::default()
    }
}

/// Unit vertices, and triangles that face outward, in f64 so that subdivision does not drift.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let corners = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)];
    let around = |make: fn(f64, f64) -> DVec3| corners.into_iter().map(move |(a, b)| make(a, b).normalize());
    let vertices = around(|a, b| DVec3::new(a, b, 0.0))
        .chain(around(|a, b| DVec3::new(0.0, a, b)))
        .chain(around(|a, b| DVec3::new(b, 0.0, a)))
        .collect::<Vec<_>>();
    // Faces are the triples of neighbours: the shortest distance between vertices is that of an edge.
    let edge = vertices.iter().skip(1).map(|v| v.distance(vertices[0])).fold(f64::INFINITY, f64::min) * 1.01;
    let near = |a: usize, b: usize| vertices[a].distance(vertices[b]) < edge;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let [p, q, r] = [a, b, c].map(|i| vertices[i]);
                    let outward = (q - p).cross(r - p).dot(p) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    (vertices, faces)
}

/// Six spheres from smooth to rough, of metal or of black lacquer, in a room of side 2 around the origin. The floor and
/// the back are checkered, the left wall is red, the right one green, the front is open; a lamp of radiance 12 is in
/// the ceiling.
pub fn spheres(metal: bool) -> Scene {
    let mut scene = Scene::empty(if metal { "metal spheres" } else { "lacquer spheres" });
    let [x, y, z] = [2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z];
    let checks = [Vec3::splat(0.75), Vec3::new(0.1, 0.15, 0.3)];
    checkerboard(&mut scene, [Vec3::new(-1.0, -1.0, 1.0), x, -z], 6, checks);
    checkerboard(&mut scene, [Vec3::new(-1.0, -1.0, -1.0), x, y], 6, checks);
    let mut wall = |name: &str, albedo: Vec3, corner: Vec3, u: Vec3, v: Vec3| {
        let material = scene.add_material(Material::lambert(name, albedo));
        scene.add_mesh(Mesh::quad(name, material, corner, u, v), DAffine3::IDENTITY);
    };
    wall("left", Vec3::new(0.6, 0.07, 0.05), Vec3::new(-1.0, -1.0, 1.0), -z, y);
    wall("right", Vec3::new(0.12, 0.45, 0.1), Vec3::new(1.0, -1.0, -1.0), z, y);
    wall("ceiling", Vec3::splat(0.7), Vec3::new(-1.0, 1.0, -1.0), x, z);
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(12.0)));
    let quad = Mesh::quad("lamp", lamp, Vec3::new(-0.3, 0.98, 0.1), Vec3::X * 0.6, Vec3::Z * 0.5);
    scene.add_mesh(quad, DAffine3::IDENTITY);
    for (center, roughness) in SPHERES.into_iter().zip(ROUGHNESSES) {
        let albedo = Vec3::splat(if metal { 0.9 } else { 0.02 });
        let gloss = Material {
            metallic: f32::from(u8::from(metal)),
            specular: 1.0,
            roughness,
            ..Material::lambert("gloss", albedo)
        };
        let material = scene.add_material(gloss);
        let sphere = sphere(material, SPHERE_RADIUS as f32, 4);
        scene.add_mesh(sphere, DAffine3::from_translation(DVec3::new(center[0], center[1], 0.0)));
    }
    scene.add_camera(&View::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, 30f32.to_radians()));
    scene
}

/// A checkered wall of side 3 at z = −1, lit by a point light without occluders.
fn lit_wall(name: &str) -> Scene {
    let mut scene = Scene::empty(name);
    let checks = [Vec3::new(0.8, 0.75, 0.6), Vec3::new(0.1, 0.2, 0.45)];
    checkerboard(&mut scene, [Vec3::new(-1.5, -1.5, -1.0), 3.0 * Vec3::X, 3.0 * Vec3::Y], 12, checks);
    let light = DAffine3::from_translation(DVec3::new(0.2, 1.2, -0.25));
    scene.add_light(LightKind::Point, Vec3::splat(8.0), light);
    scene.add_camera(&View::look_at(DVec3::Z * 3.5, DVec3::ZERO, DVec3::Y, 28f32.to_radians()));
    scene
}

/// A ball of greenish glass in front of the wall. The light is placed so that the ball's shadow falls outside the
/// visible part of the wall.
pub fn glass_ball(ior: f32, roughness: f32) -> Scene {
    let mut scene = lit_wall("glass ball");
    let glass = Material {
        ior,
        roughness,
        specular: 1.0,
        transmission: 1.0,
        thickness: 1.0,
        attenuation_color: Vec3::new(0.6, 0.9, 0.8),
        attenuation_distance: 0.8,
        ..Material::lambert("glass", Vec3::ONE)
    };
    let glass = scene.add_material(glass);
    scene.add_mesh(sphere(glass, BALL_RADIUS, 5), DAffine3::from_translation(BALL.as_dvec3()));
    scene
}

/// Two mirrors at a right angle and, behind the camera, the checkered wall that they both show, lit by a point light.
/// All of the wall is mirrored twice.
pub fn two_mirrors() -> Scene {
    let mut scene = Scene::empty("two mirrors");
    let checks = [Vec3::new(0.8, 0.75, 0.6), Vec3::new(0.1, 0.2, 0.45)];
    checkerboard(&mut scene, [Vec3::new(1.5, -1.5, 2.0), -3.0 * Vec3::X, 3.0 * Vec3::Y], 8, checks);
    let mirror =
        Material { metallic: 1.0, roughness: 0.0, specular: 1.0, ..Material::lambert("mirror", Vec3::splat(0.9)) };
    let mirror = scene.add_material(mirror);
    for (corner, along) in [
        (Vec3::new(-1.5, -1.0, 0.5), Vec3::new(1.5, 0.0, -1.5)),
        (Vec3::new(0.0, -1.0, -1.0), Vec3::new(1.5, 0.0, 1.5)),
    ] {
        scene.add_mesh(Mesh::quad("mirror", mirror, corner, along, 2.0 * Vec3::Y), DAffine3::IDENTITY);
    }
    // The wall faces away from the mirrors: no path finds the light that they reflect onto it.
    let light = DAffine3::from_translation(DVec3::new(0.2, 1.3, 1.2)) * DAffine3::from_rotation_y(std::f64::consts::PI);
    scene.add_light(LightKind::Spot { inner: 0.8, outer: 1.5 }, Vec3::splat(8.0), light);
    scene.add_camera(&View::look_at(DVec3::Z * 1.8, DVec3::ZERO, DVec3::Y, 28f32.to_radians()));
    scene
}

/// A pane of thin tinted glass in front of the wall.
pub fn thin_pane(roughness: f32) -> Scene {
    let mut scene = lit_wall("thin pane");
    let glass = Material {
        roughness,
        specular: 1.0,
        transmission: 1.0,
        double_sided: true,
        ..Material::lambert("pane", Vec3::new(0.9, 0.7, 0.5))
    };
    let glass = scene.add_material(glass);
    let pane = Mesh::quad("pane", glass, Vec3::new(-0.5, -0.5, 1.0), Vec3::X, Vec3::Y);
    scene.add_mesh(pane, DAffine3::from_rotation_y(0.2));
    scene
}

/// A floor of side 2 and a block of 0.7 × 0.1 × 0.7 that floats 0.5 above it. The only light is a point light of this
/// `radius`, 1.6 above the floor.
pub fn penumbra(radius: f32) -> Scene {
    let mut scene = Scene::empty("penumbra");
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    let floor = Mesh::quad("floor", white, Vec3::new(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    let block = Mesh::cuboid("block", white, Vec3::new(-0.35, 0.5, -0.35), Vec3::new(0.35, 0.6, 0.35), false);
    scene.add_mesh(block, DAffine3::from_rotation_y(0.4));
    let light =
        scene.add_light(LightKind::Point, Vec3::splat(4.0), DAffine3::from_translation(DVec3::new(0.3, 1.6, 0.2)));
    scene.lights[light].radius = radius;
    scene.add_camera(&View::look_at(DVec3::new(0.0, 1.2, 2.6), DVec3::ZERO, DVec3::Y, 42f32.to_radians()));
    scene
}

/// Three walls of side 2 that meet in a corner, and a block in that corner, under a uniform sky of radiance 1.
pub fn corner() -> Scene {
    let mut scene = Scene::empty("corner");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    let [x, y, z] = [2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z];
    for (name, u, v) in [("floor", z, x), ("back", x, y), ("left", y, z)] {
        scene.add_mesh(Mesh::quad(name, grey, Vec3::ZERO, u, v), DAffine3::IDENTITY);
    }
    let block = Mesh::cuboid("block", grey, Vec3::new(-0.25, 0.0, -0.25), Vec3::new(0.25, 0.6, 0.25), false);
    scene.add_mesh(block, DAffine3::from_translation(DVec3::new(0.9, 0.0, 0.9)) * DAffine3::from_rotation_y(0.5));
    scene.sky = Vec3::ONE;
    let eye = DVec3::new(3.2, 2.6, 3.6);
    scene.add_camera(&View::look_at(eye, DVec3::new(0.6, 0.5, 0.6), DVec3::Y, 38f32.to_radians()));
    scene
}
