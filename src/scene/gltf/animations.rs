//! Animation channels of node transforms and of morph targets' weights. Those of other properties are left out with a warning.

use glam::{DQuat, Vec3, Vec4};
use gltf::json::animation::Interpolation as Source;
use gltf::json::validation::Checked;

use super::accessor::{Data, Problem, missing};
use super::container::shorten;
use super::deform;
use super::document;
use super::nodes::Tree;
use crate::scene::{Animation, Channel, Interpolation, Property, Scene, Transform, WeightChannel};

pub fn load(data: &Data, tree: &Tree, scene: &mut Scene) -> Result<(), Problem> {
    for (index, source) in data.document.animations.iter().enumerate() {
        let mut animation = Animation { name: source.name.clone(), ..Animation::default() };
        for channel in &source.channels {
            match load_channel(data, tree, scene, ChannelOf { animation: index, source: channel })? {
                Some(Loaded::Transform(channel)) => {
                    animation.duration = animation.duration.max(channel.times.last().copied().unwrap_or(0.0));
                    make_animatable(&mut scene.nodes[channel.node].local);
                    animation.channels.push(channel);
                }
                Some(Loaded::Weights(channel)) => {
                    animation.duration = animation.duration.max(channel.times.last().copied().unwrap_or(0.0));
                    animation.weights.push(channel);
                }
                None => {}
            }
        }
        scene.animations.push(animation);
    }
    Ok(())
}

/// A channel replaces the translation, rotation or scale, so a matrix is decomposed into these.
fn make_animatable(local: &mut Transform) {
    if let Transform::Matrix(matrix) = local {
        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
        let rotation = if rotation.is_finite() { rotation.normalize() } else { DQuat::IDENTITY };
        *local = Transform::Trs { translation, rotation, scale };
    }
}

enum Loaded {
    Transform(Channel),
    Weights(WeightChannel),
}

/// A channel as the file has it, and the number of its animation.
#[derive(Clone, Copy)]
struct ChannelOf<'a> {
    animation: usize,
    source: &'a document::Channel,
}

/// One channel; `None` if it is left out.
fn load_channel(
    data: &Data,
    tree: &Tree,
    scene: &Scene,
    ChannelOf { animation, source }: ChannelOf,
) -> Result<Option<Loaded>, Problem> {
    let samplers = &data.document.animations[animation].samplers;
    let sampler = samplers.get(source.sampler).ok_or_else(|| missing("animation sampler", source.sampler))?;
    let Some(target) = source.target.node else { return Ok(None) };
    let node = *tree.slot.get(target).ok_or_else(|| missing("node", target))?;
    let what = format!("animation {animation}");
    let output = sampler.output.value();
    let property = match source.target.path.as_str() {
        "translation" => Some(Property::Translation),
        "scale" => Some(Property::Scale),
        "rotation" => Some(Property::Rotation),
        "weights" => None,
        other => {
            data.document
                .warn(format!("animation channels of kind \"{}\" are not supported and were ignored", shorten(other)));
            return Ok(None);
        }
    };
    // Of the nodes that are not shown, or have nothing to morph, there is no deformer.
    let deformer = scene.deformers.iter().position(|d| d.node == node);
    if property.is_none() && (deformer.is_none() || deform::targets(data, target) == 0) {
        return Ok(None);
    }
    let (interpolation, per_key) = match sampler.interpolation {
        Checked::Valid(Source::Step) => (Interpolation::Step, 1),
        Checked::Valid(Source::Linear) => (Interpolation::Linear, 1),
        Checked::Valid(Source::CubicSpline) => (Interpolation::CubicSpline, 3),
        Checked::Invalid => {
            let pointer = format!("/animations/{animation}/samplers/{}/interpolation", source.sampler);
            let unknown = data.document.stated(&pointer);
            return Err(format!("{what} has the unknown interpolation \"{unknown}\"; export the file again"));
        }
    };
    let broken = || Err(format!("{what} has keys that are NaN or infinite; export the file again"));
    let times = key_times(data, &what, sampler.input.value())?;
    let Some(property) = property else {
        let values: Vec<f32> = data.floats::<1>(output, None)?.into_iter().map(|[x]| x).collect();
        if !values.iter().all(|v| v.is_finite()) {
            return broken();
        }
        let width = deform::targets(data, target);
        if values.len() != times.len() * per_key * width {
            let (keys, have) = (times.len(), values.len());
            return Err(format!(
                "{what} has {keys} keys and {have} weights of {width} morph targets; export the file again"
            ));
        }
        let Some(deformer) = deformer.filter(|_| !times.is_empty()) else { return Ok(None) };
        return Ok(Some(Loaded::Weights(WeightChannel { deformer, times, values, width, interpolation })));
    };
    let values: Vec<Vec4> = match property {
        Property::Rotation => data.floats::<4>(output, None)?.into_iter().map(Vec4::from).collect(),
        _ => data.floats::<3>(output, None)?.into_iter().map(|v| Vec3::from(v).extend(0.0)).collect(),
    };
    if !values.iter().all(|v| v.is_finite()) {
        return broken();
    }
    if times.is_empty() {
        return Ok(None);
    }
    if values.len() != times.len() * per_key {
        return Err(format!("{what} has {} keys and {} values; export the file again", times.len(), values.len()));
    }
    Ok(Some(Loaded::Transform(Channel { node, times, property, values, interpolation })))
}

fn key_times(data: &Data, what: &str, input: usize) -> Result<Vec<f32>, Problem> {
    let times: Vec<f32> = data.floats::<1>(input, None)?.into_iter().map(|[t]| t).collect();
    if times.iter().any(|t| !t.is_finite()) || times.windows(2).any(|w| w[1] < w[0]) {
        return Err(format!("{what} has key times that do not increase; export the file again"));
    }
    Ok(times)
}
