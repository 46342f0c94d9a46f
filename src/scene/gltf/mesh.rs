//! Converts one primitive into one [`Mesh`]: triangles of any mode, checked attributes, generated normals and tangents.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;

use super::COORDINATE_MAX;
use super::accessor::{Data, Picked, Problem};
use super::deform::{self, Applied};
use super::draco;
use super::tangents;
use crate::scene::{Material, Mesh};

/// Colours outside 0 to 1 by at most this were meant to be inside.
const ROUNDING: f32 = 1e-4;

/// A primitive of the document.
pub struct SourcePrimitive<'a> {
    pub data: &'a Data<'a>,
    pub primitive: &'a Primitive,
    /// "mesh 3 primitive 0", for messages.
    pub what: String,
    /// The number of vertices.
    pub count: usize,
}

/// The `number`th primitive of mesh `mesh`; `None` if it has no triangles.
pub fn load(
    data: &Data,
    [mesh, number]: [usize; 2],
    applied: &Applied,
    materials: &[Material],
) -> Result<Option<Mesh>, Problem> {
    let what = format!("mesh {mesh} primitive {number}");
    let primitive = &data.document.meshes[mesh].primitives[number];
    let Valid(mode) = primitive.mode else {
        let mode = data.document.stated(&format!("/meshes/{mesh}/primitives/{number}/mode"));
        return Err(format!("{what} has mode {mode}, which glTF does not define; export the file again"));
    };
    if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        data.document.warn("points and lines cannot be rendered and were left out");
        return Ok(None);
    }
    let unpacked = draco::unpack(data, primitive, &what)?;
    let data = &Data { unpacked: unpacked.as_ref(), ..*data };
    let mut source = SourcePrimitive { data, primitive, what, count: 0 };
    let Some(position) = source.accessor(Semantic::Positions) else {
        source.warn("has no positions and was left out");
        return Ok(None);
    };
    let material = match primitive.material.map(|m| m.value()) {
        Some(m) if m + 1 < materials.len() => m + 1,
        Some(m) => return Err(super::missing("material", m)),
        None => 0,
    };
    source.count = data.count(position)?;
    let mut indices = source.triangles(mode)?;
    // Thousands of primitives may share one large buffer.
    let vertices = (indices.len() < source.count / 2).then(|| pick(&mut indices));
    let picked = vertices.as_ref().map(|vertices| Picked { vertices, of: source.count });
    let data = &Data { picked, ..*data };
    let count = vertices.as_ref().map_or(source.count, Vec::len);
    let source = SourcePrimitive { data, count, ..source };
    let positions: Vec<Vec3> = data.floats::<3>(position, None)?.into_iter().map(Vec3::from).collect();
    let tangent_uvs = materials[material].tangent_uvs();
    let [first_uvs, second_uvs] = data.uv_sets[material];
    let mut mesh = Mesh {
        name: data.document.meshes[mesh].name.clone().unwrap_or_default(),
        normals: source.read::<3, _>(Semantic::Normals, None)?.unwrap_or_default(),
        tangents: match tangent_uvs {
            Some(_) => source.read::<4, _>(Semantic::Tangents, None)?.unwrap_or_default(),
            None => Vec::new(),
        },
        uvs: [source.uvs(first_uvs)?, source.uvs(second_uvs)?],
        colors: source.colors()?,
        positions,
        indices,
        material,
        deform: None,
    };
    deform::apply(&source, applied, &mut mesh)?;
    check_positions(&source.what, &mesh.positions)?;
    compact(&mut mesh);
    if !complete_normals(&mut mesh) {
        source.warn("has normals without a direction; the normals of their faces replace them");
    }
    match tangent_uvs {
        Some(uvs) if !tangents::complete(&mut mesh, uvs) => {
            source.warn("has tangents without a direction; all of its tangents were generated");
        }
        Some(_) => {}
        None => mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); mesh.positions.len()],
    }
    if let Some(deformer) = &applied.deformer {
        mesh.rest_in(&deformer.rest);
        check_positions(&source.what, &mesh.positions)?;
    }
    Ok(Some(mesh))
}

fn check_positions(what: &str, positions: &[Vec3]) -> Result<(), Problem> {
    if let Some(bad) = positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("{what} has a position that is NaN or infinite (vertex {bad}); export the file again"));
    }
    if let Some(bad) = positions.iter().position(|p| p.abs().max_element() > COORDINATE_MAX as f32) {
        return Err(format!("{what} has a position beyond 10¹⁵ m (vertex {bad}); scale the scene down"));
    }
    Ok(())
}

impl SourcePrimitive<'_> {
    /// The accessor of an attribute.
    pub fn accessor(&self, semantic: Semantic) -> Option<usize> {
        self.primitive.attributes.get(&Valid(semantic)).map(|a| a.value())
    }

    fn warn(&self, text: &str) {
        self.data.document.warn(format!("{} {text}", self.what));
    }

    /// Three vertex indices per triangle of a list, a strip or a fan.
    fn triangles(&self, mode: Mode) -> Result<Vec<u32>, Problem> {
        let mut list = self.corners()?;
        // A compressed strip was decoded to a list.
        let mode = if self.data.unpacked.is_some() { Mode::Triangles } else { mode };
        Ok(match mode {
            // glTF 2.0, 3.7.2.1: every second triangle of a strip is reversed to keep its winding.
            Mode::TriangleStrip => list
                .windows(3)
                .enumerate()
                .flat_map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
                .collect(),
            Mode::TriangleFan => {
                list.get(1..).unwrap_or_default().windows(2).flat_map(|w| [w[0], w[1], list[0]]).collect()
            }
            _ => {
                if !list.len().is_multiple_of(3) {
                    self.warn("ends in an incomplete triangle, which was left out");
                    list.truncate(list.len() - list.len() % 3);
                }
                list
            }
        })
    }

    /// Vertex indices in drawing order, all below `count`.
    fn corners(&self) -> Result<Vec<u32>, Problem> {
        let (what, count) = (&self.what, self.count);
        let vertices = u32::try_from(count).map_err(|_| format!("{what} has more than 2³² vertices; split it"))?;
        let list: Vec<u32> = match (self.data.unpacked, self.primitive.indices) {
            (Some(unpacked), _) => unpacked.corners.clone(),
            (None, Some(accessor)) => self.data.integers::<1>(accessor.value())?.into_iter().map(|[i]| i).collect(),
            (None, None) => (0..vertices).collect(),
        };
        match list.iter().find(|i| **i >= vertices) {
            Some(bad) => Err(format!("{what} has index {bad} but only {count} vertices; export the file again")),
            None => Ok(list),
        }
    }

    /// The values of an attribute; `None` if it is absent.
    fn read<const N: usize, T: From<[f32; N]>>(
        &self,
        semantic: Semantic,
        pad: Option<[f32; N]>,
    ) -> Result<Option<Vec<T>>, Problem> {
        let name = semantic.to_string();
        let Some(accessor) = self.accessor(semantic) else { return Ok(None) };
        let values = self.data.floats::<N>(accessor, pad)?;
        if values.len() != self.count {
            let (what, count, have) = (&self.what, self.count, values.len());
            return Err(format!("{what} has {count} vertices but {have} values of {name}; export the file again"));
        }
        Ok(Some(values.into_iter().map(T::from).collect()))
    }

    fn uvs(&self, set: u32) -> Result<Vec<Vec2>, Problem> {
        let mut uvs = self.read::<2, Vec2>(Semantic::TexCoords(set), None)?.unwrap_or(vec![Vec2::ZERO; self.count]);
        for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
            self.warn("has texture coordinates that are NaN or infinite; they were set to 0");
            *uv = Vec2::ZERO;
        }
        Ok(uvs)
    }

    fn colors(&self) -> Result<Vec<Vec4>, Problem> {
        let mut colors =
            self.read::<4, Vec4>(Semantic::Colors(0), Some([1.0; 4]))?.unwrap_or(vec![Vec4::ONE; self.count]);
        for color in colors.iter_mut().filter(|c| c.clamp(Vec4::ZERO, Vec4::ONE) != **c) {
            // A quantised 1 may be read as a value a little above 1.
            if color.clamp(Vec4::splat(-ROUNDING), Vec4::splat(1.0 + ROUNDING)) != *color {
                self.warn("has vertex colours outside 0 to 1; they were clamped");
            }
            *color = if color.is_finite() { color.clamp(Vec4::ZERO, Vec4::ONE) } else { Vec4::ONE };
        }
        Ok(colors)
    }
}

/// Gives every vertex a unit normal: the file's, or the face's if that of the file has no direction, or flat normals if
/// the file has none. Returns false if a normal of the file has no direction.
fn complete_normals(mesh: &mut Mesh) -> bool {
    if mesh.normals.is_empty() {
        // glTF 2.0, 3.7.2.1: tangents without normals are ignored.
        mesh.tangents.clear();
        // Every triangle gets three vertices of its own, in the order of the indices.
        let indices = std::mem::take(&mut mesh.indices);
        mesh.gather(&indices);
        mesh.indices = (0..indices.len() as u32).collect();
        mesh.normals = (0..mesh.indices.len() / 3).flat_map(|t| [face_normal(mesh, t); 3]).collect();
        return true;
    }
    let mut broken = vec![false; mesh.normals.len()];
    for (normal, broken) in mesh.normals.iter_mut().zip(&mut broken) {
        match normal.as_dvec3().try_normalize() {
            Some(unit) => *normal = unit.as_vec3(),
            None => (*normal, *broken) = (Vec3::Y, true),
        }
    }
    for corner in 0..mesh.indices.len() {
        let vertex = mesh.indices[corner] as usize;
        if broken[vertex] {
            mesh.normals[vertex] = face_normal(mesh, corner / 3);
        }
    }
    !broken.contains(&true)
}

/// The distinct vertices of `indices` in the order of their first use. The indices are renumbered accordingly.
fn pick(indices: &mut [u32]) -> Vec<u32> {
    let (mut new_indices, mut picked) = (HashMap::new(), Vec::new());
    for index in indices {
        *index = *new_indices.entry(*index).or_insert_with(|| {
            picked.push(*index);
            picked.len() as u32 - 1
        });
    }
    picked
}

/// Drops vertices that no triangle uses, because bounds cover all vertices.
fn compact(mesh: &mut Mesh) {
    let mut new_indices = vec![u32::MAX; mesh.positions.len()];
    let mut kept = Vec::new();
    for index in &mut mesh.indices {
        let new = &mut new_indices[*index as usize];
        if *new == u32::MAX {
            *new = kept.len() as u32;
            kept.push(*index);
        }
        *index = *new;
    }
    mesh.gather(&kept);
}

/// The unit normal of a triangle, computed in f64 so that squared differences of large coordinates stay finite. +Y for
/// degenerate triangles.
fn face_normal(mesh: &Mesh, triangle: usize) -> Vec3 {
    let [a, b, c] = std::array::from_fn(|i| mesh.positions[mesh.indices[3 * triangle + i] as usize].as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |n| n.as_vec3())
}
