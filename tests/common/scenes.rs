//! Scenes made of bare triangles, for tests that want to know everything about them.

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use twobounce::scene::{Instance, Light, LightKind, Material, Mesh, Node, Scene, Transform};

/// Random numbers in [0,1) that are the same everywhere (Knuth's 64-bit congruential generator, upper bits).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [0,1)³.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// On the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.point() * 2.0 - 1.0;
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

/// A material that only emits.
pub fn emitter(radiance: Vec3, double_sided: bool) -> Material {
    Material { emissive: radiance, double_sided, ..diffuse(0.0) }
}

/// A Lambertian material without a specular lobe.
pub fn diffuse(albedo: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        specular_color: Vec3::ZERO,
        ..Material::default()
    }
}

/// An empty scene with one node that moves nothing.
pub fn empty() -> Scene {
    let still = Node { name: "still".into(), parent: None, local: Transform::Matrix(DAffine3::IDENTITY) };
    Scene { name: "test".into(), materials: vec![Material::default()], nodes: vec![still], ..Scene::default() }
}

/// Adds triangles of one material as a mesh of their own, positions in metres, normals by winding.
pub fn add(scene: &mut Scene, triangles: &[[DVec3; 3]], material: Material) {
    let positions: Vec<Vec3> = triangles.iter().flatten().map(|p| p.as_vec3()).collect();
    let normal = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).normalize_or(DVec3::Y).as_vec3();
    let count = positions.len();
    scene.instances.push(Instance { mesh: scene.meshes.len(), node: 0 });
    scene.meshes.push(Mesh {
        name: "triangles".into(),
        positions,
        normals: triangles.iter().flat_map(|t| [normal(t); 3]).collect(),
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); count],
        uvs: [vec![Vec2::ZERO; count], vec![Vec2::ZERO; count]],
        colors: vec![Vec4::ONE; count],
        indices: (0..count as u32).collect(),
        material: scene.materials.len(),
        ..Mesh::default()
    });
    scene.materials.push(material);
}

/// Adds a point light that hangs on a node of its own.
pub fn add_point_light(scene: &mut Scene, position: DVec3, intensity: f32) {
    let local = Transform::Matrix(DAffine3::from_translation(position));
    scene.lights.push(Light {
        name: "light".into(),
        node: scene.nodes.len(),
        kind: LightKind::Point,
        intensity: Vec3::splat(intensity),
        range: f32::INFINITY,
        radius: 0.0,
    });
    scene.nodes.push(Node { name: "light".into(), parent: None, local });
}

/// Two triangles: corner, corner + u, corner + u + v, corner + v; the front is on the side of u × v.
pub fn quad(corner: DVec3, u: DVec3, v: DVec3) -> [[DVec3; 3]; 2] {
    [[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]]
}

/// The six sides of a box, fronts outside (or inside).
pub fn cuboid(min: DVec3, max: DVec3, inside: bool) -> Vec<[DVec3; 3]> {
    let size = max - min;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| a * size);
    let mut triangles = Vec::new();
    for k in 0..3 {
        let (u, v) = (axes[(k + 1) % 3], axes[(k + 2) % 3]);
        let (near, far) = (quad(min, v, u), quad(min + axes[k], u, v));
        triangles.extend(near.into_iter().chain(far));
    }
    if inside {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    triangles
}

/// Needles: up to 32 long and at most 0.02 wide, inside [0, edge]³.
pub fn slivers(count: usize, edge: f64) -> Vec<[DVec3; 3]> {
    let mut random = Random::new(1);
    let inside = |p: DVec3| p.clamp(DVec3::ZERO, DVec3::splat(edge)).as_vec3().as_dvec3();
    let mut sliver = || {
        let a = random.point() * edge;
        let b = a + (random.point() - 0.5) * 32.0;
        [a, b, b + (random.point() - 0.5) * 0.02].map(inside)
    };
    (0..count).map(|_| sliver()).collect()
}
