//! The triangles of the posed scene in world space, in coordinates that suit f32.
//!
//! A *unit* of length is a power of two in metres, chosen so that the scene is about a thousand units wide; the scene's
//! centre is the origin. A translated scene, or one scaled by a power of two, gives the same numbers. (A thousand,
//! because obvhs ignores boxes smaller than 10⁻⁴.)

use std::borrow::Cow;

use glam::{DVec3, Vec3, Vec4};

use crate::scene::surface::{SurfacePoint, WorldFrame};
use crate::scene::{Alpha, Bounds, Material, Mesh, Pose, Scene};

/// Units across the scene.
const SPAN: f64 = 1024.0;

/// Conversion between world space in metres and units.
#[derive(Clone, Copy, Debug)]
pub struct Units {
    pub center: DVec3,
    /// Metres per unit.
    pub size: f64,
}

impl Units {
    #[inline]
    pub fn point(&self, world: DVec3) -> Vec3 {
        ((world - self.center) / self.size).as_vec3()
    }

    /// A length or distance in units.
    pub fn length(&self, metres: f32) -> f32 {
        (metres as f64 / self.size) as f32
    }
}

/// Material properties that rays test before they evaluate a material.
#[derive(Clone, Copy, Debug, Default)]
pub struct MaterialFlags {
    /// A hit counts only where the alpha mask is opaque.
    pub masked: bool,
    /// Some light may pass unscattered: alpha blend, or a smooth thin wall.
    pub transparent: bool,
    pub double_sided: bool,
    /// The surface bounds a volume: transmission refracts, and both sides of the triangle count.
    pub volume: bool,
}

/// The origin of a triangle in the scene.
#[derive(Clone, Copy, Debug)]
pub struct TriangleSource {
    pub instance: u32,
    /// Index in the instance's mesh.
    pub triangle: u32,
    /// The mesh's material, copied here because every hit reads it.
    pub material: u32,
}

/// A place on a triangle: barycentric coordinates (1−u−v, u, v).
#[derive(Clone, Copy, Debug)]
pub struct Location {
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
}

/// The interpolated attributes at a [`Location`].
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub position: Vec3,
    /// The triangle's normal on its front, unit.
    pub geometric: Vec3,
    /// The interpolated normal on the front, unit.
    pub normal: Vec3,
    /// In world space, unit; w is the bitangent's sign.
    pub tangent: Vec4,
    pub texturing: SurfacePoint,
    /// Index into the scene's materials.
    pub material: usize,
}

/// The posed scene's triangles, in units.
pub struct Geometry<'a> {
    pub scene: &'a Scene,
    pub units: Units,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[Vec3; 3]>,
    pub sources: Vec<TriangleSource>,
    /// The scene's materials, or replacements of them: see [`Self::show`].
    pub materials: &'a [Material],
    /// Flags of each material.
    pub flags: Vec<MaterialFlags>,
    /// Frames of each instance.
    frames: Vec<WorldFrame>,
    /// Meshes as the pose deforms them.
    meshes: Vec<Cow<'a, Mesh>>,
}

impl<'a> Geometry<'a> {
    /// Leaves out triangles without area or with non-finite positions.
    pub fn new(scene: &'a Scene, pose: &Pose) -> Self {
        let meshes = scene.posed_meshes(pose);
        let world = world_triangles(scene, pose, &meshes);
        let bounds = world.iter().flat_map(|(_, t)| t).copied().fold(Bounds::EMPTY, Bounds::include);
        let extent = bounds.size().max_element();
        let units = if extent > 0.0 {
            Units { center: bounds.center(), size: (extent / SPAN).log2().round().exp2() }
        } else {
            Units { center: DVec3::ZERO, size: 1.0 }
        };
        let (mut triangles, mut sources) = (Vec::new(), Vec::new());
        for (source, corners) in world {
            let t = corners.map(|c| units.point(c));
            if (t[1] - t[0]).cross(t[2] - t[0]).length_squared() > 0.0 {
                triangles.push(t);
                sources.push(source);
            }
        }
        let frames = pose.world_from_instance.iter().map(WorldFrame::new).collect();
        let mut geometry = Self { scene, units, triangles, sources, materials: &[], flags: vec![], frames, meshes };
        geometry.show(&scene.materials);
        geometry
    }

    /// Replaces the scene's materials by these.
    pub fn show(&mut self, materials: &'a [Material]) {
        self.materials = materials;
        self.flags = materials.iter().map(MaterialFlags::of_material).collect();
    }

    #[inline]
    fn mesh(&self, triangle: u32) -> (&Mesh, &WorldFrame, [usize; 3]) {
        let source = self.sources[triangle as usize];
        let instance = source.instance as usize;
        let (mesh, frame) = (&*self.meshes[self.scene.instances[instance].mesh], &self.frames[instance]);
        (mesh, frame, corners(mesh, source.triangle, frame.winding < 0.0))
    }

    /// Index of a triangle's material.
    #[inline]
    pub fn material(&self, triangle: u32) -> usize {
        self.sources[triangle as usize].material as usize
    }

    /// The texture coordinates and colour at a location, and the index of the material.
    #[inline]
    pub fn texturing(&self, at: Location) -> (SurfacePoint, usize) {
        let (mesh, _, [a, b, c]) = self.mesh(at.triangle);
        let Location { u, v, .. } = at;
        let w = 1.0 - u - v;
        let uvs = [0, 1].map(|set| mesh.uvs[set][a] * w + mesh.uvs[set][b] * u + mesh.uvs[set][c] * v);
        let color = mesh.colors[a] * w + mesh.colors[b] * u + mesh.colors[c] * v;
        (SurfacePoint { uvs, color, footprint: [0.0; 2] }, mesh.material)
    }

    /// The point at a location, for which [`Self::texturing`] gave `texturing`.
    pub fn point(&self, at: Location, texturing: SurfacePoint) -> Point {
        let Location { triangle, u, v } = at;
        let (mesh, frame, [a, b, c]) = self.mesh(triangle);
        let w = 1.0 - u - v;
        let [p0, p1, p2] = self.triangles[triangle as usize];
        let geometric = (p1 - p0).cross(p2 - p0).normalize();
        let normal = frame.normal(mesh.normals[a] * w + mesh.normals[b] * u + mesh.normals[c] * v);
        let tangent = (mesh.tangents[a] * w + mesh.tangents[b] * u + mesh.tangents[c] * v).truncate();
        Point {
            position: p0 * w + p1 * u + p2 * v,
            geometric,
            normal: if normal.dot(geometric) > 0.0 { normal } else { geometric },
            tangent: frame.tangent(tangent.extend(mesh.tangents[a].w)),
            texturing,
            material: self.material(triangle),
        }
    }
}

impl MaterialFlags {
    fn of_material(m: &Material) -> Self {
        let diffuses = m.finish.as_ref().is_some_and(|f| f.diffuse_transmission.factor > 0.0);
        let volume = (m.transmission > 0.0 || diffuses) && m.thickness > 0.0;
        Self {
            masked: matches!(m.alpha, Alpha::Mask(_)),
            transparent: m.alpha == Alpha::Blend || (m.transmission > 0.0 && !volume),
            double_sided: m.double_sided,
            volume,
        }
    }
}

/// Vertex indices, counter-clockwise seen from the front. A mirrored instance reverses the order.
fn corners(mesh: &Mesh, triangle: u32, mirrored: bool) -> [usize; 3] {
    let i = 3 * triangle as usize;
    let [a, b, c] = [0, 1, 2].map(|k| mesh.indices[i + k] as usize);
    if mirrored { [a, c, b] } else { [a, b, c] }
}

fn world_triangles(scene: &Scene, pose: &Pose, meshes: &[Cow<Mesh>]) -> Vec<(TriangleSource, [DVec3; 3])> {
    let mut triangles = Vec::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        let (mesh, world) = (&*meshes[instance.mesh], pose.world_from_instance[i]);
        let mirrored = world.matrix3.determinant() < 0.0;
        for t in 0..mesh.indices.len() as u32 / 3 {
            let corners = corners(mesh, t, mirrored).map(|c| world.transform_point3(mesh.positions[c].as_dvec3()));
            if corners.iter().all(|c| c.is_finite()) {
                triangles.push((
                    TriangleSource { instance: i as u32, triangle: t, material: mesh.material as u32 },
                    corners,
                ));
            }
        }
    }
    triangles
}
