//! Deform: skins and morph targets move the scene's vertices once for every pose, before they are recorded. Reads:
//! deform words, deform pose. Writes: scene vertices. Twin: `src/scene/deform.rs`, compared by
//! `tests/device/deform.rs`.

use std::sync::Arc;

use super::MOST_GROUPS;
use super::attributes::CornerWords;
use super::layout::DeformPush;
use super::memory_plan::MemoryRow;
use crate::Result;
use crate::scene::deform::Deform;
use crate::scene::{Pose, Scene};
use crate::vk::{self, Bind, Buffer, BufferKind, Compute, ComputeDesc, Context, Recorder, ZoneKind};

/// As in the shader.
const HAS_TANGENTS: u32 = 1;
const FLAT: u32 = 2;
/// Words of an undeformed vertex, and of a target's difference.
const BASE_WORDS: usize = 9;

/// Data that deforms a scene's vertices, on the CPU.
#[derive(Clone, Default)]
pub struct DeformPacked {
    /// For each mesh: undeformed vertices, the targets' differences, and influences.
    words: Vec<u32>,
    meshes: Vec<DeformPush>,
    /// The number of floats of a pose: joints, then weights, for each deformer.
    pose_floats: usize,
}

/// The data of [`DeformPacked`] on the device, which exists only for scenes with deforming meshes.
pub struct DeformOnGpu {
    words: Buffer,
    pose: Buffer,
    meshes: Vec<DeformPush>,
    pipeline: Compute,
}

impl DeformPacked {
    /// `first_vertex` holds the first vertex of every mesh.
    pub fn new(scene: &Scene, corner: CornerWords, first_vertex: &[i32]) -> Self {
        let mut packed = Self::default();
        let vertex_words = corner.vertex_bytes() / 4;
        let mut places = Vec::new();
        for deformer in &scene.deformers {
            let weights = packed.pose_floats + 12 * deformer.joints.len();
            places.push((packed.pose_floats, weights));
            packed.pose_floats = weights + deformer.weights.len();
        }
        for (mesh, &first_vertex) in scene.meshes.iter().zip(first_vertex) {
            let Some(deform) = &mesh.deform else { continue };
            let (first_joint, first_weight) = places[deform.deformer];
            let weights = scene.deformers[deform.deformer].weights.len();
            let tangents = if corner.tangent.is_some() { HAS_TANGENTS } else { 0 };
            packed.meshes.push(DeformPush {
                first_word: packed.words.len() as u32,
                vertices: deform.positions.len() as u32,
                targets: deform.targets.len().min(weights) as u32,
                influences: deform.influences as u32,
                first_weight: first_weight as u32,
                first_joint: first_joint as u32,
                first_vertex: (first_vertex as usize * vertex_words) as u32,
                vertex_words: vertex_words as u32,
                flags: tangents | if deform.flat { FLAT } else { 0 },
            });
            packed.add(deform, weights);
        }
        packed
    }

    fn add(&mut self, deform: &Deform, weights: usize) {
        let vertices = deform.positions.len();
        self.words.reserve(BASE_WORDS * vertices * (1 + deform.targets.len()) + 2 * deform.skin.len());
        for v in 0..vertices {
            for part in [deform.positions[v], deform.normals[v], deform.tangents[v].truncate()] {
                self.words.extend(part.to_array().map(f32::to_bits));
            }
        }
        for target in deform.targets.iter().take(weights) {
            for v in 0..vertices {
                for part in [&target.positions, &target.normals, &target.tangents] {
                    self.words.extend(part.get(v).copied().unwrap_or_default().to_array().map(f32::to_bits));
                }
            }
        }
        self.words.extend(deform.skin.iter().flat_map(|(joint, weight)| [*joint, weight.to_bits()]));
    }

    /// Memory of the deformation; empty without deforming meshes.
    pub fn plan(&self) -> Vec<MemoryRow> {
        if self.meshes.is_empty() {
            return Vec::new();
        }
        vec![("deform words", 4 * self.words.len() as u64), ("deform pose", 4 * self.pose_floats.max(1) as u64)]
    }

    /// # Errors
    /// There is too little memory, or the device is lost.
    pub fn upload(&self, context: &Arc<Context>) -> Result<Option<DeformOnGpu>> {
        let [_, (_, pose_bytes)] = self.plan()[..] else { return Ok(None) };
        let desc = ComputeDesc { label: "deform", shader: "ground/deform.comp", constants: &[] };
        Ok(Some(DeformOnGpu {
            words: vk::upload(context, "deform words", &self.words)?,
            pose: Buffer::new(context, "deform pose", pose_bytes, BufferKind::Device)?,
            meshes: self.meshes.clone(),
            pipeline: Compute::new(context, &desc)?,
        }))
    }
}

impl DeformOnGpu {
    /// Records the deformation of the scene's `vertices` to a pose.
    pub fn record(&self, recorder: &mut Recorder, vertices: &Buffer, pose: &Pose) {
        let floats = pose.deforms.iter().flat_map(|of| {
            let joints = of.joints.as_flattened().as_flattened();
            joints.iter().chain(&of.weights).copied()
        });
        let floats: Vec<f32> = floats.collect();
        let bytes = self.meshes.iter().map(|mesh| 4 * u64::from(mesh.vertices * mesh.vertex_words)).sum();
        recorder.zone("deform", ZoneKind::Compute, bytes, |r| {
            r.full_barrier(); // the previous frame read the pose and the vertices
            r.update(&self.pose, 0, &floats);
            r.full_barrier();
            let binds = [
                Bind::buffer("deform_words", &self.words),
                Bind::buffer("deform_pose", &self.pose),
                Bind::buffer("scene_vertices", vertices),
            ];
            for mesh in &self.meshes {
                let groups = mesh.vertices.div_ceil(64).min(MOST_GROUPS);
                if groups > 0 {
                    r.dispatch(&self.pipeline, &binds, mesh, [groups, 1, 1]);
                }
            }
        });
    }
}
