//! Scenes made in code: meshes of simple shapes, and methods that add the parts of a scene.

use glam::{DAffine3, DMat3, Vec2, Vec3, Vec4};

use super::{Camera, Instance, Light, LightKind, Material, Mesh, Node, Scene, Transform, View};

impl Scene {
    /// A scene that has only glTF's default material.
    pub fn empty(name: &str) -> Self {
        Self { name: name.into(), materials: vec![Material::default()], ..Self::default() }
    }

    /// Returns the material's index.
    pub fn add_material(&mut self, material: Material) -> usize {
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Adds `mesh` at a new node. Returns the instance's index.
    pub fn add_mesh(&mut self, mesh: Mesh, world_from_mesh: DAffine3) -> usize {
        let node = self.add_node(&mesh.name.clone(), world_from_mesh);
        self.meshes.push(mesh);
        self.instances.push(Instance { mesh: self.meshes.len() - 1, node });
        self.instances.len() - 1
    }

    /// Adds a light at the origin of `world_from_light` that shines along its −Z, with [`Light::intensity`]. Returns
    /// its index.
    pub fn add_light(&mut self, kind: LightKind, intensity: Vec3, world_from_light: DAffine3) -> usize {
        let node = self.add_node("light", world_from_light);
        self.lights.push(Light { name: "light".into(), node, kind, intensity, range: f32::INFINITY, radius: 0.0 });
        self.lights.len() - 1
    }

    /// Adds a camera with this view. Returns its index.
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
    /// A diffuse BRDF of albedo/π.
    pub fn lambert(name: &str, albedo: Vec3) -> Self {
        let base_color = albedo.extend(1.0);
        Self { name: name.into(), base_color, metallic: 0.0, specular: 0.0, ..Self::default() }
    }

    /// Emits `radiance` from its front and reflects nothing.
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

    /// An axis-aligned box; its normals point outward, or inward if `inward`.
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

    /// Triangles with flat normals and zero uvs. Degenerate triangles are kept.
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
