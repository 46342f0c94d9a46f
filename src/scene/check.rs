//! Checks of scenes and poses that a program made in code. Files are checked where they are read.

use super::{Interpolation, Mesh, Pose, Scene};
use crate::{Error, Result};

/// An index into a list, with the words that an error names both by.
struct Index<'a> {
    of: &'a str,
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
    /// Checks everything that the renderer and the path tracer rely on: that indices name something, that the lists of a mesh have
    /// one length, and that positions are finite.
    ///
    /// # Errors
    /// [`Error::Usage`] with the first thing that is wrong.
    pub fn check(&self) -> Result<()> {
        let index = |of: &str, index, list, length| Index { of, index, list, length }.check();
        let node = |of: &str, node| index(of, node, "node", self.nodes.len());
        for (i, image) in self.images.iter().enumerate() {
            let texels = u64::from(image.width) * u64::from(image.height);
            ensure(texels > 0 && image.rgba.len() as u64 == 4 * texels, || {
                format!("image {i} is {}x{}, but has {} bytes", image.width, image.height, image.rgba.len())
            })?;
        }
        for (i, texture) in self.textures.iter().enumerate() {
            index(&format!("texture {i}"), texture.image, "image", self.images.len())?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            for (slot, _) in material.texture_slots() {
                let of = format!("material {i}");
                index(&of, slot.texture, "texture", self.textures.len())?;
                index(&of, slot.uv_set, "set of texture coordinates", 2)?;
            }
        }
        for (i, one) in self.nodes.iter().enumerate() {
            ensure(one.parent.is_none_or(|parent| parent < i), || {
                format!("node {i} stands before its parent: list parents first")
            })?;
        }
        for (i, deformer) in self.deformers.iter().enumerate() {
            let of = format!("deformer {i}");
            node(&of, deformer.node)?;
            deformer.joints.iter().try_for_each(|joint| node(&of, joint.node))?;
        }
        for (i, mesh) in self.meshes.iter().enumerate() {
            self.check_mesh(&format!("mesh {i}"), mesh)?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            let of = format!("instance {i}");
            index(&of, instance.mesh, "mesh", self.meshes.len())?;
            node(&of, instance.node)?;
        }
        self.lights.iter().enumerate().try_for_each(|(i, light)| node(&format!("light {i}"), light.node))?;
        self.cameras.iter().enumerate().try_for_each(|(i, camera)| node(&format!("camera {i}"), camera.node))?;
        self.check_animations()
    }

    fn check_mesh(&self, of: &str, mesh: &Mesh) -> Result<()> {
        let vertices = mesh.positions.len();
        let lengths =
            [mesh.normals.len(), mesh.tangents.len(), mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len()];
        ensure(lengths.iter().all(|length| *length == vertices), || {
            format!("{of} has {vertices} positions, but not as many normals, tangents, texture coordinates and colours")
        })?;
        ensure(mesh.positions.iter().all(|position| position.is_finite()), || {
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
            && deform.skin.len() == deform.influences * vertices
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
            let of = format!("animation {i}");
            for channel in &animation.channels {
                Index { of: &of, index: channel.node, list: "node", length: self.nodes.len() }.check()?;
                let keys = channel.times.len();
                let complete = keys > 0 && channel.values.len() == keys * values(channel.interpolation);
                ensure(complete, || format!("a channel of {of} has {keys} times, but not a value for each"))?;
            }
            for channel in &animation.weights {
                Index { of: &of, index: channel.deformer, list: "deformer", length: self.deformers.len() }.check()?;
                let keys = channel.times.len();
                let complete = keys > 0
                    && channel.values.len() == keys * channel.width * values(channel.interpolation)
                    && channel.width == self.deformers[channel.deformer].weights.len();
                ensure(complete, || format!("the weights of {of} have {keys} times, but not a value for each target"))?;
            }
        }
        Ok(())
    }
}

impl Pose {
    /// Checks that the pose has a finite transform for each instance, light and joint of `scene`.
    ///
    /// # Errors
    /// [`Error::Usage`] with the first thing that is wrong.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let is_complete = self.world_from_instance.len() == scene.instances.len()
            && self.lights.len() == scene.lights.len()
            && self.deforms.len() == scene.deformers.len();
        ensure(is_complete, || {
            "a pose is of another scene: it must have each of its instances, lights and deformers".into()
        })?;
        let is_finite = self.world_from_instance.iter().all(|transform| transform.is_finite())
            && self.lights.iter().all(|light| light.position.is_finite() && light.direction.is_finite());
        ensure(is_finite, || "a pose has a transform or a light that is not finite".into())?;
        for (i, (pose, deformer)) in self.deforms.iter().zip(&scene.deformers).enumerate() {
            let (joints, weights) = (deformer.joints.len(), deformer.weights.len());
            ensure(pose.joints.len() == joints && pose.weights.len() == weights, || {
                format!("a pose of deformer {i} must have {joints} joints and {weights} weights")
            })?;
        }
        Ok(())
    }
}
