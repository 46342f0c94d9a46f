//! One primitive into one [`Mesh`]: triangles of any mode, attributes checked, what is missing made.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;

use super::accessor::{Data, Problem};
use super::deform::{self, Rest};
use super::tangents;
use super::{COORDINATE_MAX, Warnings};
use crate::scene::{Material, Mesh};

/// The `number`th primitive of mesh `mesh`; `None` where it holds no triangles.
pub fn load(
    data: &Data,
    [mesh, number]: [usize; 2],
    rest: &Rest,
    materials: &[Material],
    warnings: &mut Warnings,
) -> Result<Option<Mesh>, Problem> {
    let what = &format!("mesh {mesh} primitive {number}");
    let primitive = &data.document.meshes[mesh].primitives[number];
    let Valid(mode) = primitive.mode else {
        let mode = data.document.stated(&format!("/meshes/{mesh}/primitives/{number}/mode"));
        return Err(format!("{what} has mode {mode}, which glTF does not know; export the file again"));
    };
    if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        warnings.once("points and lines cannot be rendered and were left out");
        return Ok(None);
    }
    let Some(position) = find(primitive, Semantic::Positions) else {
        warnings.once(format!("{what} has no positions and was left out"));
        return Ok(None);
    };
    let material = match primitive.material.map(|m| m.value()) {
        Some(m) if m + 1 < materials.len() => m + 1,
        Some(m) => return Err(super::missing("material", m)),
        None => 0,
    };
    let positions: Vec<Vec3> = data.floats::<3>(position, None)?.into_iter().map(Vec3::from).collect();
    let count = positions.len();
    let indices = triangles(what, mode, corners(data, what, primitive, count)?, warnings);
    let attributes = Attributes { data, what, primitive, count };
    let normal_map = materials[material].normal_texture;
    let mut mesh = Mesh {
        name: String::new(),
        normals: attributes.read::<3, _>(Semantic::Normals, None, Vec3::from)?.unwrap_or_default(),
        tangents: match normal_map {
            Some(_) => attributes.read::<4, _>(Semantic::Tangents, None, Vec4::from)?.unwrap_or_default(),
            None => Vec::new(),
        },
        uvs: [attributes.uvs(0, warnings)?, attributes.uvs(1, warnings)?],
        colors: attributes.colors(warnings)?,
        positions,
        indices,
        material,
    };
    deform::apply(data, what, primitive, rest, &mut mesh, warnings)?;
    if let Some(bad) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("{what} has a position that is NaN or infinite (vertex {bad}); export the file again"));
    }
    if let Some(bad) = mesh.positions.iter().position(|p| p.abs().max_element() > COORDINATE_MAX as f32) {
        return Err(format!("{what} has a position beyond 10¹⁵ m (vertex {bad}); scale the scene down"));
    }
    compact(&mut mesh);
    complete_normals(what, &mut mesh, warnings);
    match normal_map {
        Some(slot) => tangents::complete(what, &mut mesh, &slot, warnings),
        None => mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); mesh.positions.len()],
    }
    Ok(Some(mesh))
}

/// The primitive's vertices in drawing order, all below `count`.
fn corners(data: &Data, what: &str, primitive: &Primitive, count: usize) -> Result<Vec<u32>, Problem> {
    let vertices = u32::try_from(count).map_err(|_| format!("{what} has more than 2³² vertices; split it"))?;
    let list: Vec<u32> = match primitive.indices {
        Some(accessor) => data.integers::<1>(accessor.value())?.into_iter().map(|[i]| i).collect(),
        None => (0..vertices).collect(),
    };
    match list.iter().find(|i| **i >= vertices) {
        Some(bad) => Err(format!("{what} has index {bad} but only {count} vertices; export the file again")),
        None => Ok(list),
    }
}

/// Three vertices per triangle of a list, a strip or a fan.
fn triangles(what: &str, mode: Mode, mut list: Vec<u32>, warnings: &mut Warnings) -> Vec<u32> {
    match mode {
        // glTF 2.0, 3.7.2.1: every second triangle of a strip is turned to keep its winding.
        Mode::TriangleStrip => list
            .windows(3)
            .enumerate()
            .flat_map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => list.get(1..).unwrap_or_default().windows(2).flat_map(|w| [w[0], w[1], list[0]]).collect(),
        _ => {
            if !list.len().is_multiple_of(3) {
                warnings.once(format!("{what} ends in an incomplete triangle, which was left out"));
                list.truncate(list.len() - list.len() % 3);
            }
            list
        }
    }
}

/// The accessor of an attribute.
fn find(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Valid(semantic)).map(|a| a.value())
}

struct Attributes<'a> {
    data: &'a Data<'a>,
    what: &'a str,
    primitive: &'a Primitive,
    count: usize,
}

impl Attributes<'_> {
    fn read<const N: usize, T>(
        &self,
        semantic: Semantic,
        pad: Option<[f32; N]>,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Option<Vec<T>>, Problem> {
        let name = semantic.to_string();
        let Some(accessor) = find(self.primitive, semantic) else { return Ok(None) };
        let values = self.data.floats::<N>(accessor, pad)?;
        if values.len() != self.count {
            let (what, count, have) = (self.what, self.count, values.len());
            return Err(format!("{what} has {count} vertices but {have} values of {name}; export the file again"));
        }
        Ok(Some(values.into_iter().map(make).collect()))
    }

    fn uvs(&self, set: u32, warnings: &mut Warnings) -> Result<Vec<Vec2>, Problem> {
        let mut uvs = self
            .read::<2, _>(Semantic::TexCoords(set), None, Vec2::from)?
            .unwrap_or_else(|| vec![Vec2::ZERO; self.count]);
        for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
            warnings.once(format!("{} has texture coordinates that are NaN or infinite; they are 0 now", self.what));
            *uv = Vec2::ZERO;
        }
        Ok(uvs)
    }

    fn colors(&self, warnings: &mut Warnings) -> Result<Vec<Vec4>, Problem> {
        let mut colors = self
            .read::<4, _>(Semantic::Colors(0), Some([1.0; 4]), Vec4::from)?
            .unwrap_or_else(|| vec![Vec4::ONE; self.count]);
        for color in colors.iter_mut().filter(|c| c.clamp(Vec4::ZERO, Vec4::ONE) != **c) {
            warnings.once(format!("{} has vertex colours outside 0 to 1; they were clamped", self.what));
            *color = if color.is_finite() { color.clamp(Vec4::ZERO, Vec4::ONE) } else { Vec4::ONE };
        }
        Ok(colors)
    }
}

/// Unit normals for all vertices: the file's; a face's where one of the file's is no direction; flat ones where it has none.
fn complete_normals(what: &str, mesh: &mut Mesh, warnings: &mut Warnings) {
    if mesh.normals.is_empty() {
        // Tangents without normals are to be ignored (glTF 2.0, 3.7.2.1).
        mesh.tangents.clear();
        unweld(mesh);
        mesh.normals = (0..mesh.indices.len() / 3).flat_map(|t| [face_normal(mesh, t); 3]).collect();
        return;
    }
    let mut broken = vec![false; mesh.normals.len()];
    for (normal, broken) in mesh.normals.iter_mut().zip(&mut broken) {
        match normal.as_dvec3().try_normalize() {
            Some(unit) => *normal = unit.as_vec3(),
            None => (*normal, *broken) = (Vec3::Y, true),
        }
    }
    if !broken.contains(&true) {
        return;
    }
    warnings.once(format!("{what} has normals without a direction; the normals of their faces replace them"));
    for t in 0..mesh.indices.len() / 3 {
        for corner in 0..3 {
            let vertex = mesh.indices[3 * t + corner] as usize;
            if broken[vertex] {
                mesh.normals[vertex] = face_normal(mesh, t);
            }
        }
    }
}

/// Drops vertices that no triangle uses: primitives often share one large buffer, and bounds are taken over vertices.
fn compact(mesh: &mut Mesh) {
    let mut place = vec![u32::MAX; mesh.positions.len()];
    let mut kept = Vec::new();
    for index in &mut mesh.indices {
        let place = &mut place[*index as usize];
        if *place == u32::MAX {
            *place = kept.len() as u32;
            kept.push(*index);
        }
        *index = *place;
    }
    gather(mesh, &kept);
}

/// Gives every triangle three vertices of its own, in index order.
fn unweld(mesh: &mut Mesh) {
    let indices = std::mem::take(&mut mesh.indices);
    gather(mesh, &indices);
    mesh.indices = (0..indices.len() as u32).collect();
}

/// Makes the vertices numbered `from` the mesh's vertices, in that order.
fn gather(mesh: &mut Mesh, from: &[u32]) {
    fn pick<T: Copy>(values: &mut Vec<T>, from: &[u32]) {
        if !values.is_empty() {
            *values = from.iter().map(|&i| values[i as usize]).collect();
        }
    }
    pick(&mut mesh.positions, from);
    pick(&mut mesh.normals, from);
    pick(&mut mesh.tangents, from);
    mesh.uvs.iter_mut().for_each(|uvs| pick(uvs, from));
    pick(&mut mesh.colors, from);
}

/// In f64: coordinates of 10³⁰ are finite, the squares of their differences must be too. +Y for degenerate triangles.
fn face_normal(mesh: &Mesh, triangle: usize) -> Vec3 {
    let [a, b, c] = std::array::from_fn(|i| mesh.positions[mesh.indices[3 * triangle + i] as usize].as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |n| n.as_vec3())
}
