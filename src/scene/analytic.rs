//! Scenes in code whose light is known by a formula, or whose geometry is hard on a renderer. Units: SI, see [`super`].

use glam::{DAffine3, DVec3, Vec3};

use super::{LightKind, Material, Mesh, Scene, View};

/// What lights [`cornell`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// An emissive rectangle in the ceiling.
    Area,
    /// A point light below it.
    Point,
}

/// A closed box of side 2 around the origin, all of it diffuse with `albedo` and sending `emission`: after n bounces the
/// radiance is `emission` · Σ albedoᵏ, k = 0…n, everywhere. With `block`, a box of the same kind stands inside.
pub fn furnace(albedo: f32, emission: f32, block: bool) -> Scene {
    let mut scene = Scene::empty("furnace");
    let wall = Material { emissive: Vec3::splat(emission), ..Material::lambert("wall", Vec3::splat(albedo)) };
    let wall = scene.add_material(wall);
    scene.add_mesh(Mesh::cuboid("box", wall, Vec3::NEG_ONE, Vec3::ONE, true), DAffine3::IDENTITY);
    if block {
        let block = Mesh::cuboid("block", wall, Vec3::splat(-0.4), Vec3::splat(0.4), false);
        // Turned, so that its sides do not follow the grid.
        scene.add_mesh(block, DAffine3::from_rotation_y(0.5) * DAffine3::from_rotation_x(0.3));
    }
    scene.add_camera(&View::look_at(DVec3::new(0.55, 0.35, 0.9), DVec3::ZERO, DVec3::Y, 75f32.to_radians()));
    scene
}

/// The Cornell box (Goral et al. 1984, colours and blocks as commonly used), in a cube of side 2 around the origin, seen
/// from +Z. Walls are doubleSided and open in front.
pub fn cornell(lamp: Lamp) -> Scene {
    let mut scene = Scene::empty("cornell");
    let mut wall = |name: &str, albedo: [f32; 3]| {
        let material = Material::lambert(name, Vec3::from(albedo));
        scene.add_material(Material { double_sided: true, ..material })
    };
    let white = wall("white", [0.725, 0.71, 0.68]);
    let red = wall("red", [0.63, 0.065, 0.05]);
    let green = wall("green", [0.14, 0.45, 0.091]);
    let mut quad = |name: &str, material: usize, corner: [f32; 3], u: Vec3, v: Vec3| {
        scene.add_mesh(Mesh::quad(name, material, Vec3::from(corner), u, v), DAffine3::IDENTITY);
    };
    let [x, y, z] = [2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z];
    quad("floor", white, [-1.0, -1.0, 1.0], x, -z);
    quad("back", white, [-1.0, -1.0, -1.0], x, y);
    quad("left", red, [-1.0, -1.0, 1.0], -z, y);
    quad("right", green, [1.0, -1.0, -1.0], z, y);
    let (half_width, half_depth) = (0.235, 0.19);
    match lamp {
        Lamp::Point => quad("ceiling", white, [-1.0, 1.0, -1.0], x, z),
        Lamp::Area => {
            // A frame, so that ceiling and lamp do not lie in each other.
            let depth = Vec3::Z * (1.0 - half_depth);
            quad("ceiling back", white, [-1.0, 1.0, -1.0], x, depth);
            quad("ceiling front", white, [-1.0, 1.0, half_depth], x, depth);
            let (across, along) = (Vec3::X * (1.0 - half_width), Vec3::Z * 2.0 * half_depth);
            quad("ceiling left", white, [-1.0, 1.0, -half_depth], across, along);
            quad("ceiling right", white, [half_width, 1.0, -half_depth], across, along);
        }
    }
    // Blocks: centre on the floor, half width, height, and a turn about +Y.
    for (name, [cx, cz], half, height, turn) in
        [("tall", [-0.33, -0.28], 0.3, 1.2, 0.318_558f64), ("short", [0.33, 0.38], 0.3, 0.6, -0.297_515)]
    {
        let block = Mesh::cuboid(name, white, Vec3::new(-half, 0.0, -half), Vec3::new(half, height, half), false);
        let at = DVec3::new(cx, -1.0, cz);
        scene.add_mesh(block, DAffine3::from_translation(at) * DAffine3::from_rotation_y(turn));
    }
    match lamp {
        Lamp::Area => {
            let light = scene.add_material(Material::lamp("light", Vec3::new(18.387, 13.987, 6.754)));
            let corner = Vec3::new(-half_width, 1.0, -half_depth);
            let quad = Mesh::quad("light", light, corner, Vec3::X * 2.0 * half_width, Vec3::Z * 2.0 * half_depth);
            scene.add_mesh(quad, DAffine3::IDENTITY);
        }
        Lamp::Point => {
            let place = DAffine3::from_translation(DVec3::new(0.0, 0.7, 0.1));
            scene.add_light(LightKind::Point, Vec3::splat(3.0), place);
        }
    }
    scene.add_camera(&View::look_at(DVec3::new(0.0, 0.0, 3.9), DVec3::ZERO, DVec3::Y, 37f32.to_radians()));
    scene
}

/// A lamp of radiance 1 and a diffuse receiver of `albedo`, two unit squares that face each other `distance` apart along
/// Y: the receiver (y = 0) gets a mean irradiance of π · [`parallel_form_factor`].
pub fn parallel_squares(distance: f32, albedo: f32) -> Scene {
    let mut scene = Scene::empty("parallel squares");
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    let receiver = scene.add_material(Material::lambert("receiver", Vec3::splat(albedo)));
    let floor = Mesh::quad("receiver", receiver, Vec3::new(-0.5, 0.0, 0.5), Vec3::X, Vec3::NEG_Z);
    let ceiling = Mesh::quad("lamp", lamp, Vec3::new(-0.5, distance, -0.5), Vec3::X, Vec3::Z);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    scene.add_mesh(ceiling, DAffine3::IDENTITY);
    scene
}

/// Form factor between facing unit squares at `distance` (Howell's catalogue, C-11).
pub fn parallel_form_factor(distance: f64) -> f64 {
    let x = 1.0 / distance;
    let r = (1.0 + x * x).sqrt();
    let logarithm = (r.powi(4) / (1.0 + 2.0 * x * x)).sqrt().ln();
    2.0 / (std::f64::consts::PI * x * x) * (logarithm + 2.0 * x * r * (x / r).atan() - 2.0 * x * x.atan())
}

/// As [`parallel_squares`], but with a common edge along X and a right angle; see [`PERPENDICULAR_FORM_FACTOR`].
pub fn perpendicular_squares(albedo: f32) -> Scene {
    let mut scene = Scene::empty("perpendicular squares");
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    let receiver = scene.add_material(Material::lambert("receiver", Vec3::splat(albedo)));
    let floor = Mesh::quad("receiver", receiver, Vec3::new(-0.5, 0.0, 1.0), Vec3::X, Vec3::NEG_Z);
    let wall = Mesh::quad("lamp", lamp, Vec3::new(-0.5, 0.0, 0.0), Vec3::X, Vec3::Y);
    scene.add_mesh(floor, DAffine3::IDENTITY);
    scene.add_mesh(wall, DAffine3::IDENTITY);
    scene
}

/// Form factor between unit squares at a right angle with a common edge (Howell's catalogue, C-14).
pub const PERPENDICULAR_FORM_FACTOR: f64 = 0.200_043_776_075_403_47;

/// The inside of a sphere of radius `radius` and diffuse `albedo` with a point light of intensity `intensity` in its
/// centre: full light sends ρI / (πR²(1 − ρ)), up to the tessellation (20 · 4ⁿ triangles).
pub fn lit_sphere(radius: f32, albedo: f32, intensity: f32, subdivisions: u32) -> Scene {
    let mut scene = Scene::empty("lit sphere");
    let wall = scene.add_material(Material::lambert("wall", Vec3::splat(albedo)));
    scene.add_mesh(Mesh::sphere("sphere", wall, radius, subdivisions, true), DAffine3::IDENTITY);
    scene.add_light(LightKind::Point, Vec3::splat(intensity), DAffine3::IDENTITY);
    let eye = DVec3::new(0.0, 0.0, 0.5 * f64::from(radius));
    scene.add_camera(&View::look_at(eye, DVec3::ZERO, DVec3::Y, 60f32.to_radians()));
    scene
}

/// A diffuse floor of side 4 in the plane y = 0 under one light of intensity 1 at (0, 1, 0) that shines straight down,
/// seen from above: direct light alone, so that each kind's falloff can be held against its formula.
pub fn lit_floor(kind: LightKind, albedo: f32) -> Scene {
    let mut scene = Scene::empty("lit floor");
    let floor = scene.add_material(Material::lambert("floor", Vec3::splat(albedo)));
    let quad = Mesh::quad("floor", floor, Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z);
    scene.add_mesh(quad, DAffine3::IDENTITY);
    let down = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    scene.add_light(kind, Vec3::ONE, DAffine3::from_translation(DVec3::Y) * down);
    scene.add_camera(&View::look_at(DVec3::new(0.0, 3.0, 0.0), DVec3::ZERO, DVec3::NEG_Z, 60f32.to_radians()));
    scene
}

/// `count` triangles in the unit cube that are hard to voxelise: a third are needles, a third are smaller than a voxel of
/// any grid up to 256, a third are of any shape. The same for the same `seed`.
pub fn slivers(count: usize, seed: u64) -> Scene {
    let mut random = Random(seed);
    let triangle = |i: usize| {
        let a = random.vector();
        let (b, c) = match i % 3 {
            0 => (random.vector(), 1e-4 * (random.vector() - 0.5)),
            1 => (a + 2e-3 * (random.vector() - 0.5), 2e-3 * (random.vector() - 0.5)),
            _ => (random.vector(), random.vector() - 0.5),
        };
        [a, b, (b + c).clamp(Vec3::ZERO, Vec3::ONE)]
    };
    let triangles: Vec<[Vec3; 3]> = (0..count).map(triangle).collect();
    let mut scene = Scene::empty("slivers");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::triangles("slivers", grey, &triangles), DAffine3::IDENTITY);
    scene
}

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// Uniform in the unit cube; 24 bits, so that f32 holds them exactly.
    fn vector(&mut self) -> Vec3 {
        Vec3::from([0; 3].map(|_| (self.next() >> 40) as f32 / (1 << 24) as f32))
    }
}
