//! Animation channels of node transforms and of morph targets' weights. Those of other properties are left out with a
//! warning.

use std::collections::HashMap;

use glam::{DQuat, Vec3, Vec4};
use gltf::json::animation::Interpolation as Source;
use gltf::json::validation::Checked;

use super::accessor::{Data, Problem, missing};
use super::container::shorten;
use super::deform;
use super::document;
use super::nodes::NodeOrder;
use crate::scene::{Animation, Channel, Interpolation, Property, Scene, Transform, WeightChannel};

pub fn load(data: &Data, tree: &NodeOrder, scene: &mut Scene) -> Result<(), Problem> {
    let deformers = scene.deformers.iter().enumerate().map(|(index, deformer)| (deformer.node, index)).collect();
    for (number, source) in data.document.animations.iter().enumerate() {
        let mut animation = Animation { name: source.name.clone(), ..Animation::default() };
        for channel in &source.channels {
            let loading = Loading { data, tree, deformers: &deformers, number, channel };
            let last = loading.load(scene, &mut animation)?;
            animation.duration = animation.duration.max(last);
        }
        scene.animations.push(animation);
    }
    Ok(())
}

/// A channel of the file, with the number of its animation.
struct Loading<'a> {
    data: &'a Data<'a>,
    tree: &'a NodeOrder,
    /// Deformers by node.
    deformers: &'a HashMap<usize, usize>,
    number: usize,
    channel: &'a document::Channel,
}

impl Loading<'_> {
    /// Adds the channel to `animation`, unless it is left out, and returns the time of its last key.
    fn load(&self, scene: &mut Scene, animation: &mut Animation) -> Result<f32, Problem> {
        let (data, target) = (self.data, &self.channel.target);
        let samplers = &data.document.animations[self.number].samplers;
        let sampler = samplers.get(self.channel.sampler);
        let sampler = sampler.ok_or_else(|| missing("animation sampler", self.channel.sampler))?;
        let Some(index) = target.node else { return Ok(0.0) };
        let node = *self.tree.slot.get(index).ok_or_else(|| missing("node", index))?;
        let property = match target.path.as_str() {
            "translation" => Some(Property::Translation),
            "scale" => Some(Property::Scale),
            "rotation" => Some(Property::Rotation),
            "weights" => None,
            other => {
                let other = shorten(other);
                data.document
                    .warn(format!("animation channels of kind \"{other}\" are not supported and were ignored"));
                return Ok(0.0);
            }
        };
        // Nodes that are not shown or have nothing to morph have no deformer.
        let deformer = self.deformers.get(&node).copied();
        let width = if property.is_none() { deform::targets(data, index) } else { 0 };
        if property.is_none() && (deformer.is_none() || width == 0) {
            return Ok(0.0);
        }
        let what = format!("animation {}", self.number);
        let (interpolation, per_key) = match sampler.interpolation {
            Checked::Valid(Source::Step) => (Interpolation::Step, 1),
            Checked::Valid(Source::Linear) => (Interpolation::Linear, 1),
            Checked::Valid(Source::CubicSpline) => (Interpolation::CubicSpline, 3),
            Checked::Invalid => {
                let pointer = format!("/animations/{}/samplers/{}/interpolation", self.number, self.channel.sampler);
                let unknown = data.document.stated(&pointer);
                return Err(format!("{what} has the unknown interpolation \"{unknown}\"; export the file again"));
            }
        };
        let times = data.floats::<1>(sampler.input.value(), None)?.into_flattened();
        if times.iter().any(|t| !t.is_finite()) || times.windows(2).any(|w| w[1] < w[0]) {
            return Err(format!("{what} has key times that do not increase; export the file again"));
        }
        let (keys, output) = (times.len(), sampler.output.value());
        let numbers = match property {
            None => data.floats::<1>(output, None)?.into_flattened(),
            Some(Property::Rotation) => data.floats::<4>(output, None)?.into_flattened(),
            Some(_) => data.floats::<3>(output, None)?.into_flattened(),
        };
        if !numbers.iter().all(|v| v.is_finite()) {
            return Err(format!("{what} has keys that are NaN or infinite; export the file again"));
        }
        if property.is_none() && numbers.len() != keys * per_key * width {
            let have = numbers.len();
            return Err(format!(
                "{what} has {keys} keys and {have} weights of {width} morph targets; export the file again"
            ));
        }
        let Some(&last) = times.last() else { return Ok(0.0) };
        match (property, deformer) {
            (Some(property), _) => {
                let components = if property == Property::Rotation { 4 } else { 3 };
                let value = |v: &[f32]| Vec3::from_slice(v).extend(v.get(3).copied().unwrap_or(0.0));
                let values: Vec<Vec4> = numbers.chunks_exact(components).map(value).collect();
                if values.len() != keys * per_key {
                    return Err(format!("{what} has {keys} keys and {} values; export the file again", values.len()));
                }
                let local = &mut scene.nodes[node].local;
                if let Transform::Matrix(matrix) = local {
                    // A channel replaces the translation, rotation or scale.
                    let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
                    let rotation = if rotation.is_finite() { rotation.normalize() } else { DQuat::IDENTITY };
                    *local = Transform::Trs { translation, rotation, scale };
                }
                animation.channels.push(Channel { node, times, property, values, interpolation });
            }
            (None, Some(deformer)) => {
                animation.weights.push(WeightChannel { deformer, times, values: numbers, width, interpolation });
            }
            (None, None) => {}
        }
        Ok(last)
    }
}
