//! The pose of a scene at a time: evaluates keyed channels, then the node tree in f64.

use glam::{DAffine3, DQuat, DVec3, DVec4};

use super::gltf::list;
use super::{Channel, Interpolation, Pose, PosedLight, Property, Scene, Transform};
use crate::{Error, Result};

impl Scene {
    /// The pose at `time_s` seconds of `animation`; with the file's own transforms if `animation` is `None`. Before its
    /// first key and after its last one a channel is constant.
    pub fn pose(&self, animation: Option<usize>, time_s: f32) -> Pose {
        let mut locals: Vec<Transform> = self.nodes.iter().map(|n| n.local).collect();
        if let Some(animation) = animation.and_then(|a| self.animations.get(a)) {
            animation.channels.iter().for_each(|c| c.apply(time_s, &mut locals[c.node]));
        }
        let world = self.compose(&locals);
        let light = |node: usize| PosedLight {
            position: world[node].translation,
            direction: world[node].matrix3.z_axis.try_normalize().map_or(DVec3::NEG_Z, |z| -z),
        };
        Pose {
            world_from_instance: self.instances.iter().map(|i| world[i.node]).collect(),
            lights: self.lights.iter().map(|l| light(l.node)).collect(),
            world_from_camera: self.cameras.iter().map(|c| world[c.node]).collect(),
        }
    }

    /// Of every node, whether an animation moves it.
    pub fn moving_nodes(&self) -> Vec<bool> {
        let mut moves = vec![false; self.nodes.len()];
        self.animations.iter().flat_map(|animation| &animation.channels).for_each(|channel| moves[channel.node] = true);
        for (index, node) in self.nodes.iter().enumerate() {
            moves[index] |= node.parent.is_some_and(|parent| moves[parent]);
        }
        moves
    }

    /// The transform of every node without animation.
    pub(super) fn world_from_nodes(&self) -> Vec<DAffine3> {
        self.compose(&self.nodes.iter().map(|n| n.local).collect::<Vec<_>>())
    }

    fn compose(&self, locals: &[Transform]) -> Vec<DAffine3> {
        let mut world: Vec<DAffine3> = Vec::with_capacity(locals.len());
        for (node, local) in self.nodes.iter().zip(locals) {
            let local = local.matrix();
            world.push(node.parent.map_or(local, |p| world[p] * local));
        }
        world
    }

    /// The index of the animation with the name or number `name`.
    ///
    /// # Errors
    /// [`Error::Usage`] with a list of the animations.
    pub fn animation_named(&self, name: &str) -> Result<usize> {
        named("animation", name, self.animations.iter().map(|a| a.name.as_str()))
    }

    /// The index of the camera with the name or number `name`.
    ///
    /// # Errors
    /// [`Error::Usage`] with a list of the cameras.
    pub fn camera_named(&self, name: &str) -> Result<usize> {
        named("camera", name, self.cameras.iter().map(|c| c.name.as_str()))
    }
}

fn named<'a>(kind: &str, name: &str, names: impl Iterator<Item = &'a str>) -> Result<usize> {
    let names: Vec<&str> = names.collect();
    let by_name = names.iter().position(|n| *n == name);
    let found = by_name.or_else(|| name.parse().ok().filter(|i| *i < names.len()));
    found.ok_or_else(|| {
        Error::Usage(match names.is_empty() {
            true => format!("--{kind} {name}: the scene has no {kind}s; leave the flag out"),
            false => format!("--{kind} {name}: the scene has no such {kind}; it has {}", list(names.into_iter())),
        })
    })
}

impl Transform {
    /// The parent's space from the node's space.
    pub fn matrix(&self) -> DAffine3 {
        match *self {
            Self::Matrix(matrix) => matrix,
            Self::Trs { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
        }
    }
}

impl Channel {
    /// Writes the value at `time_s` into `local`.
    fn apply(&self, time_s: f32, local: &mut Transform) {
        let Transform::Trs { translation, rotation, scale } = local else { return };
        let value = self.value(time_s);
        match self.property {
            Property::Translation => *translation = value.truncate(),
            Property::Scale => *scale = value.truncate(),
            Property::Rotation => *rotation = unit(DQuat::from_vec4(value)),
        }
    }

    fn value(&self, time_s: f32) -> DVec4 {
        let (key, part, seconds) = self.span(time_s);
        let at = |i: usize| self.values[i].as_dvec4();
        match self.interpolation {
            Interpolation::CubicSpline if part > 0.0 => {
                let [v0, b0, a1, v1] = [1, 2, 3, 4].map(|i| at(3 * key + i));
                let [h00, h10, h01, h11] = hermite(part);
                h00 * v0 + h10 * seconds * b0 + h01 * v1 + h11 * seconds * a1
            }
            Interpolation::CubicSpline => at(3 * key + 1),
            Interpolation::Linear if part > 0.0 && self.property == Property::Rotation => {
                let [from, to] = [at(key), at(key + 1)].map(|v| unit(DQuat::from_vec4(v)));
                from.slerp(to, part).into()
            }
            Interpolation::Linear if part > 0.0 => at(key).lerp(at(key + 1), part),
            _ => at(key),
        }
    }

    /// The key before `time_s`, the position between it and the next key (0 to 1), and the seconds between the two.
    fn span(&self, time_s: f32) -> (usize, f64, f64) {
        let after = self.times.partition_point(|t| *t <= time_s);
        if after == 0 || after == self.times.len() {
            return (after.saturating_sub(1), 0.0, 0.0);
        }
        let [from, to] = [self.times[after - 1], self.times[after]].map(f64::from);
        (after - 1, (f64::from(time_s) - from) / (to - from), to - from)
    }
}

fn unit(q: DQuat) -> DQuat {
    if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
}

/// Weights of the two values and two tangents of a cubic Hermite spline (glTF 2.0, appendix C.5).
fn hermite(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2]
}
