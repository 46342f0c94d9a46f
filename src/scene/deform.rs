//! Skins and morph targets: the data that deform meshes, and the deformed meshes of a pose. `glsl/ground/deform.comp`
//! computes [`Deform::vertices`] on the device; `tests/device/deform.rs` compares both.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3, Vec4};

use super::{Mesh, Pose, Scene};

/// Data by which a node deforms its meshes: the joints of a skin, weights of morph targets, or both.
#[derive(Clone, Debug, Default)]
pub struct Deformer {
    /// Index into [`Scene::nodes`].
    pub node: usize,
    /// Joints of the skin, followed by the node itself for vertices that no joint moves; empty without a skin.
    pub joints: Vec<Joint>,
    /// Weights of the morph targets that apply without an animation.
    pub weights: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Index into [`Scene::nodes`].
    pub node: usize,
    /// The joint's space from the mesh's, in the bind pose.
    pub joint_from_mesh: DAffine3,
}

/// How the vertices of one mesh deform. All lists are as long as the mesh has vertices, or empty.
#[derive(Clone, Debug, Default)]
pub struct Deform {
    /// Index into [`Scene::deformers`].
    pub deformer: usize,
    /// Positions as in the file. The positions of the mesh itself are those of its rest pose.
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec4>,
    pub targets: Vec<TargetDeltas>,
    /// The number of joints that influence a vertex; 0 without a skin.
    pub influences: usize,
    /// Joint and weight, [`Self::influences`] for each vertex; the weights of a vertex add up to 1.
    pub skin: Vec<(u32, f32)>,
    /// Whether the file has no normals. Then the normals are those of the deformed faces, and each face has three
    /// vertices of its own, in order.
    pub flat: bool,
}

/// The differences that a morph target adds to vertices.
#[derive(Clone, Debug, Default)]
pub struct TargetDeltas {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec3>,
}

/// The state of a [`Deformer`] at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeformPose {
    /// For each joint, the rows of the matrix from the mesh's space to the instance's space.
    pub joints: Vec<[[f32; 4]; 3]>,
    pub weights: Vec<f32>,
}

impl Deformer {
    /// The transform to world space of the frame in which skinned meshes are deformed. In glTF only the joints place a
    /// skinned mesh. A frame at the first joint keeps the precision of f32 far from the origin. It is mirrored if the
    /// node is, because this determines the front side of faces.
    pub fn world_from_frame(&self, world: &[DAffine3]) -> DAffine3 {
        let Some(first) = self.joints.first() else { return world[self.node] };
        let mirrored = world[self.node].matrix3.determinant() < 0.0;
        let scale = DVec3::new(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
        DAffine3::from_translation(world[first.node].translation) * DAffine3::from_scale(scale)
    }

    /// `world` holds the transforms of all nodes, and `weights` replaces the deformer's own weights.
    pub fn pose(&self, world: &[DAffine3], weights: Vec<f32>) -> DeformPose {
        let frame_from_world = self.world_from_frame(world).inverse();
        let rows = |joint: &Joint| {
            let m = frame_from_world * world[joint.node] * joint.joint_from_mesh;
            // Damaged files have transforms that overflow. Their vertices may be anywhere, but must be finite.
            let finite = |x: f64| if x.is_finite() { x.clamp(-1e15, 1e15) as f32 } else { 0.0 };
            let row = |i: usize| m.matrix3.row(i).extend(m.translation[i]).to_array().map(finite);
            [row(0), row(1), row(2)]
        };
        DeformPose { joints: self.joints.iter().map(rows).collect(), weights }
    }
}

/// Positions, normals and tangents of all vertices.
pub type Vertices = (Vec<Vec3>, Vec<Vec3>, Vec<Vec4>);

impl Deform {
    /// The vertices in a pose: morph targets first, then the skin.
    pub fn vertices(&self, pose: &DeformPose) -> Vertices {
        let vertices = 0..self.positions.len();
        let (mut positions, mut normals, mut tangents) = (Vec::new(), Vec::new(), Vec::new());
        for v in vertices.clone() {
            let [mut position, mut normal, mut tangent] = self.morphed(pose, v);
            if self.influences > 0 {
                let rows = self.blended(pose, v);
                let linear = rows.map(|row| row.truncate());
                position = linear_of(&linear, position) + Vec3::new(rows[0].w, rows[1].w, rows[2].w);
                normal = cofactor_of(&linear, normal);
                tangent = linear_of(&linear, tangent);
            }
            positions.push(position);
            normals.push(unit_or(normal, self.normals[v]));
            let kept = self.tangents[v];
            tangents.push(unit_or(tangent, kept.truncate()).extend(kept.w));
        }
        if self.flat {
            for v in vertices {
                let [a, b, c] = [0, 1, 2].map(|k| positions[v - v % 3 + k]);
                normals[v] = unit_or((b - a).cross(c - a), self.normals[v]);
            }
        }
        (positions, normals, tangents)
    }

    fn morphed(&self, pose: &DeformPose, v: usize) -> [Vec3; 3] {
        let mut sums = [self.positions[v], self.normals[v], self.tangents[v].truncate()];
        for (target, &weight) in self.targets.iter().zip(&pose.weights).filter(|(_, weight)| **weight != 0.0) {
            let parts = [&target.positions, &target.normals, &target.tangents];
            for (sum, part) in sums.iter_mut().zip(parts).filter(|(_, part)| !part.is_empty()) {
                *sum += weight * part[v];
            }
        }
        sums
    }

    /// The weighted mean of the joints' matrices for vertex `v`, row by row.
    fn blended(&self, pose: &DeformPose, v: usize) -> [Vec4; 3] {
        let mut rows = [Vec4::ZERO; 3];
        for &(joint, weight) in &self.skin[v * self.influences..][..self.influences] {
            for (row, of) in rows.iter_mut().zip(&pose.joints[joint as usize]) {
                *row += weight * Vec4::from_array(*of);
            }
        }
        rows
    }

    /// Keeps only the vertices with the indices `from`, in that order. The mesh's own vertices are gathered later.
    pub fn gather(&mut self, from: &[u32]) {
        for target in &mut self.targets {
            gather(&mut target.positions, from);
            gather(&mut target.normals, from);
            gather(&mut target.tangents, from);
        }
        let of = |&vertex: &u32| &self.skin[vertex as usize * self.influences..][..self.influences];
        self.skin = from.iter().flat_map(of).copied().collect();
    }

    /// Bytes of all lists.
    pub fn bytes(&self) -> usize {
        let targets = self.targets.iter().map(|t| t.positions.len() + t.normals.len() + t.tangents.len());
        40 * self.positions.len() + 12 * targets.sum::<usize>() + 8 * self.skin.len()
    }
}

/// Keeps only the values with the indices `from`, in that order. An empty list stays empty.
fn gather<T: Copy>(values: &mut Vec<T>, from: &[u32]) {
    if !values.is_empty() {
        *values = from.iter().map(|&i| values[i as usize]).collect();
    }
}

fn linear_of(rows: &[Vec3; 3], v: Vec3) -> Vec3 {
    Vec3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v))
}

/// The normal `v`, transformed by the inverse transpose of the matrix up to a positive factor. It also exists for
/// singular matrices.
fn cofactor_of(rows: &[Vec3; 3], v: Vec3) -> Vec3 {
    Vec3::new(rows[1].cross(rows[2]).dot(v), rows[2].cross(rows[0]).dot(v), rows[0].cross(rows[1]).dot(v))
}

fn unit_or(v: Vec3, other: Vec3) -> Vec3 {
    // The rows are scaled first, so that no square overflows or vanishes.
    let largest = v.abs().max_element();
    if largest > 0.0 && largest.is_finite() { (v / largest).normalize() } else { other }
}

impl Mesh {
    /// The mesh in a pose; a reference to itself if nothing deforms it.
    pub fn posed(&self, pose: &Pose) -> Cow<'_, Self> {
        let Some(deform) = &self.deform else { return Cow::Borrowed(self) };
        let (positions, normals, tangents) = deform.vertices(&pose.deforms[deform.deformer]);
        Cow::Owned(Self { positions, normals, tangents, ..self.clone() })
    }

    /// The positions of the mesh in a pose.
    pub fn posed_positions(&self, pose: &Pose) -> Cow<'_, [Vec3]> {
        match &self.deform {
            Some(deform) => Cow::Owned(deform.vertices(&pose.deforms[deform.deformer]).0),
            None => Cow::Borrowed(&self.positions),
        }
    }

    /// Keeps only the vertices with the indices `from`, in that order.
    pub(super) fn gather(&mut self, from: &[u32]) {
        if from.iter().copied().eq(0..self.positions.len() as u32) {
            return; // nothing changes
        }
        gather(&mut self.positions, from);
        gather(&mut self.normals, from);
        gather(&mut self.tangents, from);
        self.uvs.iter_mut().for_each(|uvs| gather(uvs, from));
        gather(&mut self.colors, from);
        if let Some(deform) = self.deform.as_mut().map(Arc::make_mut) {
            deform.gather(from);
        }
    }

    /// Takes the current vertices as the undeformed ones, and replaces them by those of the rest pose.
    pub fn rest_in(&mut self, pose: &DeformPose) {
        let Some(deform) = self.deform.as_mut().map(Arc::make_mut) else { return };
        deform.positions = std::mem::take(&mut self.positions);
        deform.normals = std::mem::take(&mut self.normals);
        deform.tangents = std::mem::take(&mut self.tangents);
        (self.positions, self.normals, self.tangents) = deform.vertices(pose);
    }
}

impl Scene {
    /// All meshes in a pose.
    pub fn posed_meshes(&self, pose: &Pose) -> Vec<Cow<'_, Mesh>> {
        self.meshes.iter().map(|mesh| mesh.posed(pose)).collect()
    }

    /// The deformer of the mesh, if it has a skin.
    pub fn skinned(&self, mesh: usize) -> Option<&Deformer> {
        let deformer = &self.deformers[self.meshes[mesh].deform.as_ref()?.deformer];
        (!deformer.joints.is_empty()).then_some(deformer)
    }
}
