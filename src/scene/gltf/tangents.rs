//! Tangents for normal maps: the file's, or MikkTSpace's as glTF demands.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec3, Vec4};

use super::Warnings;
use crate::scene::{Mesh, TextureRef};

/// Fills `mesh.tangents`. A mesh of which one tangent is no direction gets all of them anew.
pub fn complete(what: &str, mesh: &mut Mesh, slot: &TextureRef, warnings: &mut Warnings) {
    let usable = |t: &Vec4| t.truncate().as_dvec3().try_normalize().is_some() && t.w.is_finite();
    if !mesh.tangents.is_empty() {
        if mesh.tangents.iter().all(usable) {
            for t in &mut mesh.tangents {
                *t = t.truncate().as_dvec3().normalize().as_vec3().extend(if t.w < 0.0 { -1.0 } else { 1.0 });
            }
            return;
        }
        warnings.once(format!("{what} has tangents without a direction; they were made anew"));
    }
    generate(mesh, slot);
}

/// MikkTSpace over the uvs as the normal texture sees them, so that a rotated texture turns its tangents too. Vertices
/// whose faces disagree are split.
fn generate(mesh: &mut Mesh, slot: &TextureRef) {
    let mut corners = Corners { mesh, slot, tangents: vec![None; mesh.indices.len()] };
    // The error type has no values; corners that nothing was set for are filled below.
    let _ = generate_tangents(&mut corners);
    let tangents = corners.tangents;
    mesh.tangents = vec![Vec4::ZERO; mesh.positions.len()];
    let mut split: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    for (corner, tangent) in tangents.into_iter().enumerate() {
        let old = mesh.indices[corner];
        let tangent = tangent.unwrap_or_else(|| any_tangent(mesh.normals[old as usize]));
        mesh.indices[corner] = *split.entry((old, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
            let at = old as usize;
            if mesh.tangents[at] == Vec4::ZERO {
                mesh.tangents[at] = tangent;
                return old;
            }
            mesh.positions.push(mesh.positions[at]);
            mesh.normals.push(mesh.normals[at]);
            mesh.uvs.iter_mut().for_each(|uvs| uvs.push(uvs[at]));
            mesh.colors.push(mesh.colors[at]);
            mesh.tangents.push(tangent);
            mesh.tangents.len() as u32 - 1
        });
    }
    for (tangent, normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        if *tangent == Vec4::ZERO {
            *tangent = any_tangent(*normal);
        }
    }
}

/// Where uvs give no direction (degenerate or constant), any unit vector across the normal serves.
fn any_tangent(normal: Vec3) -> Vec4 {
    normal.any_orthonormal_vector().extend(1.0)
}

struct Corners<'a> {
    mesh: &'a Mesh,
    slot: &'a TextureRef,
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

    /// glTF's normal maps point up where v is small: the bitangent runs against v.
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.slot.transform.transform_point2(self.mesh.uvs[self.slot.uv_set][self.vertex(face, corner)]);
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.map(|s| Vec4::from(s.tangent_encoded()));
        let unit = tangent.and_then(|t| Some(t.truncate().try_normalize()?.extend(t.w)));
        self.tangents[3 * face + corner] = unit;
    }
}
