//! Animation channels of node transforms. Channels of morph weights and of other properties are left out with a warning.

use glam::{DQuat, Vec3, Vec4};
use gltf::json::animation::Interpolation as Source;
use gltf::json::validation::Checked;

use super::accessor::{Data, Problem, missing};
use super::container::shorten;
use super::document;
use super::nodes::Tree;
use crate::scene::{Animation, Channel, Interpolation, Property, Scene, Transform};

pub fn load(data: &Data, tree: &Tree, scene: &mut Scene) -> Result<(), Problem> {
    for (index, source) in data.document.animations.iter().enumerate() {
        let mut animation = Animation { name: source.name.clone(), duration: 0.0, channels: Vec::new() };
        for channel in &source.channels {
            let Some(channel) = load_channel(data, tree, index, channel)? else { continue };
            animation.duration = animation.duration.max(channel.times.last().copied().unwrap_or(0.0));
            make_animatable(&mut scene.nodes[channel.node].local);
            animation.channels.push(channel);
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

/// One channel of animation number `animation`; `None` if it is left out.
fn load_channel(
    data: &Data,
    tree: &Tree,
    animation: usize,
    source: &document::Channel,
) -> Result<Option<Channel>, Problem> {
    let samplers = &data.document.animations[animation].samplers;
    let sampler = samplers.get(source.sampler).ok_or_else(|| missing("animation sampler", source.sampler))?;
    let Some(node) = source.target.node else { return Ok(None) };
    let node = *tree.slot.get(node).ok_or_else(|| missing("node", node))?;
    let what = format!("animation {animation}");
    let output = sampler.output.value();
    let property = match source.target.path.as_str() {
        "translation" => Property::Translation,
        "scale" => Property::Scale,
        "rotation" => Property::Rotation,
        "weights" => {
            data.document.warn("animated morph weights are not supported; morph targets keep their default weights");
            return Ok(None);
        }
        other => {
            data.document
                .warn(format!("animation channels of kind \"{}\" are not supported and were ignored", shorten(other)));
            return Ok(None);
        }
    };
    let values: Vec<Vec4> = match property {
        Property::Rotation => data.floats::<4>(output, None)?.into_iter().map(Vec4::from).collect(),
        _ => data.floats::<3>(output, None)?.into_iter().map(|v| Vec3::from(v).extend(0.0)).collect(),
    };
    if !values.iter().all(|v| v.is_finite()) {
        return Err(format!("{what} has keys that are NaN or infinite; export the file again"));
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
    let times: Vec<f32> = data.floats::<1>(sampler.input.value(), None)?.into_iter().map(|[t]| t).collect();
    if times.iter().any(|t| !t.is_finite()) || times.windows(2).any(|w| w[1] < w[0]) {
        return Err(format!("{what} has key times that do not increase; export the file again"));
    }
    if times.is_empty() {
        return Ok(None);
    }
    if values.len() != times.len() * per_key {
        return Err(format!("{what} has {} keys and {} values; export the file again", times.len(), values.len()));
    }
    Ok(Some(Channel { node, times, property, values, interpolation }))
}
