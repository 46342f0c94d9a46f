//! Scenes made in code: shapes as meshes, and a scene's parts added one by one.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};

use super::{Camera, Instance, Light, LightKind, Material, Mesh, Node, Scene, Transform, View};

impl Scene {
    /// A scene with nothing but glTF's default material.
    pub fn empty(name: &str) -> Self {
        Self { name: name.into(), materials: vec![Material::default()], ..Self::default() }
    }

    /// Returns the material's index.
    pub fn add_material(&mut self, material: Material) -> usize {
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Hangs `mesh` on a node of its own. Returns the instance's index.
    pub fn add_mesh(&mut self, mesh: Mesh, world_from_mesh: DAffine3) -> usize {
        let node = self.add_node(&mesh.name.clone(), world_from_mesh);
        self.meshes.push(mesh);
        self.instances.push(Instance { mesh: self.meshes.len() - 1, node });
        self.instances.len() - 1
    }

    /// A light at the origin of `world_from_light`, shining along its −Z; `intensity` as in [`Light`].
    pub fn add_light(&mut self, kind: LightKind, intensity: Vec3, world_from_light: DAffine3) -> usize {
        let node = self.add_node("light", world_from_light);
        self.lights.push(Light { name: "light".into(), node, kind, intensity, range: f32::INFINITY, radius: 0.0 });
        self.lights.len() - 1
    }

    /// A camera that sees `view`.
    pub fn add_camera(&mut self, view: &View) -> usize {
        let axes = DMat3::from_cols(view.right(), view.up, -view.forward);
        let node = self.add_node("camera", DAffine3::from_mat3_translation(axes, view.eye));
        self.cameras.push(Camera { name: "camera".into(), node, projection: view.projection });
        self.cameras.len() - 1
    }

    fn add_node(&mut self, name: &str, matrix: DAffine3) -> usize {
        self.nodes.push(Node { name: name.into(), parent: None, local: Transform::Matrix(matrix) });
        self.nodes.len() - 1
    }
}

impl Material {
    /// Albedo/π and nothing else.
    pub fn lambert(name: &str, albedo: Vec3) -> Self {
        let base_color = albedo.extend(1.0);
        Self { name: name.into(), base_color, metallic: 0.0, specular: 0.0, ..Self::default() }
    }

    /// Sends `radiance` from its front and reflects nothing.
    pub fn lamp(name: &str, radiance: Vec3) -> Self {
        Self { emissive: radiance, ..Self::lambert(name, Vec3::ZERO) }
    }
}

impl Mesh {
    /// A parallelogram whose normal is along `u` × `v`; its uvs are (0, 0) at `corner` to (1, 1).
    pub fn quad(name: &str, material: usize, corner: Vec3, u: Vec3, v: Vec3) -> Self {
        let mut mesh = Self { name: name.into(), material, ..Self::default() };
        mesh.push_quad(corner, u, v);
        mesh
    }

    /// An axis-aligned box with normals outward, or inward.
    pub fn cuboid(name: &str, material: usize, min: Vec3, max: Vec3, inward: bool) -> Self {
        let mut mesh = Self { name: name.into(), material, ..Self::default() };
        let size = max - min;
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * size);
        for axis in 0..3 {
            let [u, v] = [axes[(axis + 1) % 3], axes[(axis + 2) % 3]];
            let [near, far] = if inward { [(u, v), (v, u)] } else { [(v, u), (u, v)] };
            mesh.push_quad(min, near.0, near.1);
            mesh.push_quad(min + axes[axis], far.0, far.1);
        }
        mesh
    }

    /// A sphere around the origin with smooth normals: an icosahedron whose edges are halved `subdivisions` times, with
    /// 20 · 4ⁿ triangles and its vertices on the sphere.
    pub fn sphere(name: &str, material: usize, radius: f32, subdivisions: u32, inward: bool) -> Self {
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
        let mut mesh = Self { name: name.into(), material, ..Self::default() };
        for direction in directions.iter().map(|d| d.as_vec3()) {
            mesh.push_vertex(direction * radius, if inward { -direction } else { direction }, Vec2::ZERO);
        }
        let wind = |[a, b, c]: [u32; 3]| if inward { [a, c, b] } else { [a, b, c] };
        mesh.indices = triangles.into_iter().flat_map(wind).collect();
        mesh
    }

    /// Triangles with flat normals and no uvs; degenerate ones are kept.
    pub fn triangles(name: &str, material: usize, triangles: &[[Vec3; 3]]) -> Self {
        let mut mesh = Self { name: name.into(), material, ..Self::default() };
        for &[a, b, c] in triangles {
            let normal = (b - a).as_dvec3().cross((c - a).as_dvec3()).try_normalize().map_or(Vec3::Y, |n| n.as_vec3());
            for corner in [a, b, c] {
                mesh.indices.push(mesh.positions.len() as u32);
                mesh.push_vertex(corner, normal, Vec2::ZERO);
            }
        }
        mesh
    }

    fn push_quad(&mut self, corner: Vec3, u: Vec3, v: Vec3) {
        let first = self.positions.len() as u32;
        let normal = u.cross(v).normalize_or(Vec3::Y);
        for uv in [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] {
            self.push_vertex(corner + u * uv.x + v * uv.y, normal, uv);
        }
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }

    fn push_vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) {
        self.positions.push(position);
        self.normals.push(normal);
        self.tangents.push(Vec4::new(1.0, 0.0, 0.0, 1.0));
        self.uvs.iter_mut().for_each(|uvs| uvs.push(uv));
        self.colors.push(Vec4::ONE);
    }
}

/// Unit vertices and outward triangles, in f64 so that subdivision does not drift.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let corners = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)];
    let around = |turn: fn(f64, f64) -> DVec3| corners.into_iter().map(move |(a, b)| turn(a, b).normalize());
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
