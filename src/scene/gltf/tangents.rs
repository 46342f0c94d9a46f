//! Tangents for normal maps and anisotropy: the file's, else MikkTSpace's, as glTF demands.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Affine2, Vec3, Vec4};

use crate::scene::Mesh;

/// Fills `mesh.tangents` from the file or by MikkTSpace. If one of the file's tangents has no direction, all are
/// generated and the result is false.
pub fn complete(mesh: &mut Mesh, uvs: (usize, Affine2)) -> bool {
    let usable = |t: &Vec4| t.truncate().as_dvec3().try_normalize().is_some() && t.w.is_finite();
    let valid = mesh.tangents.iter().all(usable);
    if mesh.tangents.is_empty() || !valid {
        generate(mesh, uvs);
        return valid;
    }
    for t in &mut mesh.tangents {
        *t = t.truncate().as_dvec3().normalize().as_vec3().extend(if t.w < 0.0 { -1.0 } else { 1.0 });
    }
    true
}

/// MikkTSpace over the transformed uvs of the texture that needs tangents, so that a rotated texture rotates the
/// tangents too. Vertices that need several tangents are split.
fn generate(mesh: &mut Mesh, uvs: (usize, Affine2)) {
    let mut corners = Corners { mesh, uvs, tangents: vec![None; mesh.indices.len()] };
    // The error type has no values; corners without a tangent get one below.
    let _ = generate_tangents(&mut corners);
    let tangents_of_corners = corners.tangents;
    let mut tangents = vec![Vec4::ZERO; mesh.positions.len()];
    // For each vertex, the index of the vertex that it copies. Split-off copies come last.
    let mut from: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let mut split: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    for (index, tangent) in mesh.indices.iter_mut().zip(tangents_of_corners) {
        let old = *index;
        let tangent = tangent.unwrap_or_else(|| any_tangent(mesh.normals[old as usize]));
        *index = *split.entry((old, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
            if tangents[old as usize] == Vec4::ZERO {
                tangents[old as usize] = tangent;
                return old;
            }
            from.push(old);
            tangents.push(tangent);
            from.len() as u32 - 1
        });
    }
    mesh.tangents.clear();
    mesh.gather(&from);
    for (tangent, normal) in tangents.iter_mut().zip(&mesh.normals) {
        if *tangent == Vec4::ZERO {
            *tangent = any_tangent(*normal);
        }
    }
    mesh.tangents = tangents;
}

/// Any unit vector orthogonal to the normal, for degenerate triangles and constant uvs.
fn any_tangent(normal: Vec3) -> Vec4 {
    normal.any_orthonormal_vector().extend(1.0)
}

struct Corners<'a> {
    mesh: &'a Mesh,
    uvs: (usize, Affine2),
    tangents: Vec<Option<Vec4>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[3 * face + corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }

    /// In glTF's normal maps +Y points towards smaller v, so the bitangent points against v.
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let (set, transform) = self.uvs;
        let uv = transform.transform_point2(self.mesh.uvs[set][self.vertex(face, corner)]);
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.map(|s| Vec4::from(s.tangent_encoded()));
        let unit = tangent.and_then(|t| Some(t.truncate().try_normalize()?.extend(t.w)));
        self.tangents[3 * face + corner] = unit;
    }
}
