//! Checks of scenes and poses that a program made in code. Files are checked where they are read.

use std::fmt::Arguments;

use super::{Interpolation, Mesh, Pose, Scene};
use crate::{Error, Result};

/// An index into a list, with the words by which errors name both. The text is formatted only for an error.
struct Index<'a> {
    of: Arguments<'a>,
    index: usize,
    list: &'a str,
    length: usize,
}

impl Index<'_> {
    fn check(&self) -> Result<()> {
        let Self { of, index, list, length } = self;
        ensure(index < length, || format!("{of} refers to {list} {index}, but the scene has {length}"))
    }
}

fn ensure(holds: bool, problem: impl FnOnce() -> String) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::Usage(problem())) }
}

impl Scene {
    /// Checks everything that the renderer and the path tracer rely on: that indices name something, that the lists of
    /// a mesh have one length, and that positions are finite.
    ///
    /// # Errors
    /// [`Error::Usage`] with the first thing that is wrong.
    pub fn check(&self) -> Result<()> {
        let index = |of: Arguments, index, list, length| Index { of, index, list, length }.check();
        let node = |of: Arguments, node| index(of, node, "node", self.nodes.len());
        for (i, image) in self.images.iter().enumerate() {
            let texels = u64::from(image.width) * u64::from(image.height);
            ensure(texels > 0 && image.rgba.len() as u64 == texels.saturating_mul(4), || {
                format!("image {i} is {}x{}, but has {} bytes", image.width, image.height, image.rgba.len())
            })?;
        }
        for (i, texture) in self.textures.iter().enumerate() {
            index(format_args!("texture {i}"), texture.image, "image", self.images.len())?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            for (slot, _) in material.texture_slots() {
                index(format_args!("material {i}"), slot.texture, "texture", self.textures.len())?;
                index(format_args!("material {i}"), slot.uv_set, "set of texture coordinates", 2)?;
            }
        }
        for (i, one) in self.nodes.iter().enumerate() {
            ensure(one.parent.is_none_or(|parent| parent < i), || {
                format!("node {i} stands before its parent: list parents first")
            })?;
        }
        for (i, deformer) in self.deformers.iter().enumerate() {
            let nodes = deformer.joints.iter().map(|joint| joint.node).chain([deformer.node]);
            nodes.into_iter().try_for_each(|joint| node(format_args!("deformer {i}"), joint))?;
        }
        for (i, mesh) in self.meshes.iter().enumerate() {
            self.check_mesh(format_args!("mesh {i}"), mesh)?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            index(format_args!("instance {i}"), instance.mesh, "mesh", self.meshes.len())?;
            node(format_args!("instance {i}"), instance.node)?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            node(format_args!("light {i}"), light.node)?;
        }
        for (i, camera) in self.cameras.iter().enumerate() {
            node(format_args!("camera {i}"), camera.node)?;
        }
        self.check_animations()
    }

    fn check_mesh(&self, of: Arguments, mesh: &Mesh) -> Result<()> {
        let vertices = mesh.positions.len();
        let lengths =
            [mesh.normals.len(), mesh.tangents.len(), mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len()];
        ensure(lengths.iter().all(|length| *length == vertices), || {
            format!("{of} has {vertices} positions, but not as many normals, tangents, texture coordinates and colours")
        })?;
        let deformed = mesh.deform.iter().flat_map(|deform| {
            deform.positions.iter().chain(deform.targets.iter().flat_map(|target| &target.positions))
        });
        ensure(mesh.positions.iter().chain(deformed).all(|position| position.is_finite()), || {
            format!("{of} has a position that is not finite")
        })?;
        let inside = |index: &u32| (*index as usize) < vertices;
        ensure(mesh.indices.len().is_multiple_of(3) && mesh.indices.iter().all(inside), || {
            format!("the indices of {of} are not three a triangle, each below its {vertices} vertices")
        })?;
        Index { of, index: mesh.material, list: "material", length: self.materials.len() }.check()?;
        let Some(deform) = &mesh.deform else { return Ok(()) };
        Index { of, index: deform.deformer, list: "deformer", length: self.deformers.len() }.check()?;
        let deformer = &self.deformers[deform.deformer];
        let lengths = [deform.positions.len(), deform.normals.len(), deform.tangents.len()];
        let targets = deform
            .targets
            .iter()
            .flat_map(|t| [t.positions.len(), t.normals.len(), t.tangents.len()])
            .filter(|n| *n > 0);
        let complete = lengths.into_iter().chain(targets).all(|length| length == vertices)
            && deform.skin.len() == deform.influences.saturating_mul(vertices)
            && deform.targets.len() <= deformer.weights.len()
            && (!deform.flat || vertices.is_multiple_of(3));
        ensure(complete, || format!("the skin or the morph targets of {of} do not have a value for each vertex"))?;
        ensure(deform.skin.iter().all(|(joint, _)| (*joint as usize) < deformer.joints.len()), || {
            format!("{of} refers to a joint that deformer {} lacks: it has {}", deform.deformer, deformer.joints.len())
        })
    }

    fn check_animations(&self) -> Result<()> {
        let values = |interpolation| if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        for (i, animation) in self.animations.iter().enumerate() {
            for channel in &animation.channels {
                Index {
                    of: format_args!("animation {i}"),
                    index: channel.node,
                    list: "node",
                    length: self.nodes.len(),
                }
                .check()?;
                let keys = channel.times.len();
                let complete = keys > 0 && channel.values.len() == keys * values(channel.interpolation);
                ensure(complete, || format!("a channel of animation {i} has {keys} times, but not a value for each"))?;
            }
            for channel in &animation.weights {
                let length = self.deformers.len();
                Index { of: format_args!("animation {i}"), index: channel.deformer, list: "deformer", length }
                    .check()?;
                let (keys, targets) = (channel.times.len(), self.deformers[channel.deformer].weights.len());
                let complete = keys > 0
                    && channel.width == targets
                    && channel.values.len() == (keys * values(channel.interpolation)).saturating_mul(targets);
                ensure(complete, || {
                    format!(
                        "the weights of animation {i} have {keys} times, but not a value for each of {targets} targets"
                    )
                })?;
            }
        }
        Ok(())
    }
}

impl Pose {
    /// Checks that the pose has a finite transform for each instance, light, camera and joint of `scene`.
    ///
    /// # Errors
    /// [`Error::Usage`] with the first thing that is wrong.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let is_complete = self.world_from_instance.len() == scene.instances.len()
            && self.lights.len() == scene.lights.len()
            && self.world_from_camera.len() == scene.cameras.len()
            && self.deforms.len() == scene.deformers.len();
        ensure(is_complete, || {
            "a pose is of another scene: it must have each of its instances, lights, cameras and deformers".into()
        })?;
        let finite = |of: Arguments, holds: bool| {
            ensure(holds, || {
                format!("the transform of {of} is not finite in this pose: take another moment of the animation")
            })
        };
        for (i, transform) in self.world_from_instance.iter().enumerate() {
            finite(format_args!("instance {i}"), transform.is_finite())?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            finite(format_args!("light {i}"), light.position.is_finite() && light.direction.is_finite())?;
        }
        for (i, (pose, deformer)) in self.deforms.iter().zip(&scene.deformers).enumerate() {
            let (joints, weights) = (deformer.joints.len(), deformer.weights.len());
            ensure(pose.joints.len() == joints && pose.weights.len() == weights, || {
                format!("a pose of deformer {i} must have {joints} joints and {weights} weights")
            })?;
            let numbers = pose.joints.iter().flatten().flatten().chain(&pose.weights);
            finite(format_args!("deformer {i}"), numbers.into_iter().all(|number| number.is_finite()))?;
        }
        Ok(())
    }
}
