//! The pose of a scene at a time: evaluates keyed channels, then the node tree in f64.

use glam::{DAffine3, DQuat, DVec3, DVec4};

use super::deform::DeformPose;
use super::gltf::list;
use super::{
    Channel, Instance, Interpolation, Node, Playback, Pose, PosedLight, Property, Scene, Transform, WeightChannel,
};
use crate::{Error, Result};

impl Playback {
    /// Playback of one animation, or of none.
    pub fn once(animation: Option<usize>) -> Self {
        Self { animations: animation.into_iter().collect(), repeats: false }
    }
}

impl Scene {
    /// The pose at `time_s` seconds of `animation`; with the file's own transforms if `animation` is `None`. Before its
    /// first key and after its last one a channel is constant.
    pub fn pose(&self, animation: Option<usize>, time_s: f32) -> Pose {
        self.pose_of(&Playback::once(animation), f64::from(time_s))
    }

    /// The pose at `time_s` seconds with all animations of `playback`. Node transforms, skins and weights of morph
    /// targets are evaluated at the same time.
    pub fn pose_of(&self, playback: &Playback, time_s: f64) -> Pose {
        self.at_moment(playback, time_s, |world, deforms| {
            let light = |node: usize| {
                let place = world.of_node(node);
                let direction = place.matrix3.z_axis.try_normalize().map_or(DVec3::NEG_Z, |z| -z);
                PosedLight { position: place.translation, direction }
            };
            Pose {
                world_from_instance: self.instances.iter().map(|i| self.place(i, world)).collect(),
                lights: self.lights.iter().map(|l| light(l.node)).collect(),
                world_from_camera: self.cameras.iter().map(|c| world.of_node(c.node)).collect(),
                deforms,
                time_s,
            }
        })
    }

    /// Calls `then` with the transforms of nodes at `time_s` seconds of `playback`, and with the states of deformers.
    pub(super) fn at_moment<T>(
        &self,
        playback: &Playback,
        time_s: f64,
        then: impl FnOnce(&World, Vec<DeformPose>) -> T,
    ) -> T {
        let playing = || playback.animations.iter().filter_map(|&a| self.animations.get(a));
        let moved = playing().flat_map(|animation| &animation.channels).map(|channel| channel.node + 1).max();
        let mut locals: Vec<Transform> = self.nodes[..moved.unwrap_or(0)].iter().map(|n| n.local).collect();
        let mut weights: Vec<Vec<f32>> = self.deformers.iter().map(|d| d.weights.clone()).collect();
        for animation in playing() {
            let length = f64::from(animation.duration);
            let looped = playback.repeats && length > 0.0 && !(0.0..=length).contains(&time_s);
            let time = if looped { time_s.rem_euclid(length) } else { time_s } as f32;
            animation.channels.iter().for_each(|c| c.apply(time, &mut locals[c.node]));
            animation.weights.iter().for_each(|c| weights[c.deformer] = c.at(time));
        }
        let parents = self.nodes.iter().filter_map(|node| node.parent);
        let joints = self.deformers.iter().flat_map(|d| d.joints.iter().map(|joint| joint.node).chain([d.node]));
        let asked = parents.chain(joints).max().map_or(0, |last| last + 1);
        let world = World::new(&self.nodes, &locals, asked);
        let deforms = self.deformers.iter().zip(weights);
        then(&world, deforms.map(|(deformer, weights)| deformer.pose(&world.inner, weights)).collect())
    }

    /// The transform of an instance: that of its node, or with a skin that of its joints, offset as instancing offsets
    /// it from the node.
    pub(super) fn place(&self, instance: &Instance, world: &World) -> DAffine3 {
        let own = world.of_node(instance.node);
        let Some(deformer) = self.skinned(instance.mesh) else { return own };
        let frame = deformer.world_from_frame(&world.inner);
        let moved = own * world.of_node(deformer.node).inverse() * frame;
        if instance.node == deformer.node || !moved.is_finite() { frame } else { moved }
    }

    /// For each node, whether an animation moves it.
    pub fn moving_nodes(&self) -> Vec<bool> {
        let mut moves = vec![false; self.nodes.len()];
        self.animations.iter().flat_map(|animation| &animation.channels).for_each(|channel| moves[channel.node] = true);
        for (index, node) in self.nodes.iter().enumerate() {
            moves[index] |= node.parent.is_some_and(|parent| moves[parent]);
        }
        moves
    }

    /// The index of the animation with the name or number `name`.
    ///
    /// # Errors
    /// [`Error::Usage`] with a list of the animations.
    pub fn animation_named(&self, name: &str) -> Result<usize> {
        named("animation", name, self.animations.iter().map(|a| a.name.as_str()))
    }

    /// The indices of the animations that `name` selects: one by its name or number, or all by `all`, unless an
    /// animation has that name.
    ///
    /// # Errors
    /// As for [`Self::animation_named`].
    pub fn animations_named(&self, name: &str) -> Result<Vec<usize>> {
        let one = self.animation_named(name);
        match one {
            Err(_) if name == "all" && !self.animations.is_empty() => Ok((0..self.animations.len()).collect()),
            one => Ok(vec![one?]),
        }
    }

    /// The index of the camera with the name or number `name`.
    ///
    /// # Errors
    /// [`Error::Usage`] with a list of the cameras.
    pub fn camera_named(&self, name: &str) -> Result<usize> {
        named("camera", name, self.cameras.iter().map(|c| c.name.as_str()))
    }
}

/// World transforms of nodes. Small files can have millions of instances, each at its own node, which follows all nodes
/// that have children: their transforms are computed on request.
pub(super) struct World<'a> {
    nodes: &'a [Node],
    locals: &'a [Transform],
    /// Transforms of the first nodes, which include all parents.
    pub inner: Vec<DAffine3>,
}

impl<'a> World<'a> {
    /// `locals` replace the transforms of the first nodes. The first `count` nodes include all parents.
    pub fn new(nodes: &'a [Node], locals: &'a [Transform], count: usize) -> Self {
        let mut world = Self { nodes, locals, inner: Vec::with_capacity(count) };
        for node in 0..count {
            world.inner.push(world.of_node(node));
        }
        world
    }

    /// The world transform of one node.
    pub fn of_node(&self, node: usize) -> DAffine3 {
        if let Some(place) = self.inner.get(node) {
            return *place;
        }
        let Node { parent, local, .. } = &self.nodes[node];
        let local = self.locals.get(node).unwrap_or(local).matrix();
        parent.map_or(local, |parent| self.inner[parent] * local)
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
        let (key, part, seconds) = span(&self.times, time_s);
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
}

impl WeightChannel {
    /// The weights at `time_s`.
    fn at(&self, time_s: f32) -> Vec<f32> {
        let (key, part, seconds) = span(&self.times, time_s);
        let at = |row: usize, target: usize| f64::from(self.values[row * self.width + target]);
        let weight = |target: usize| match self.interpolation {
            Interpolation::CubicSpline if part > 0.0 => {
                let [v0, b0, a1, v1] = [1, 2, 3, 4].map(|i| at(3 * key + i, target));
                let [h00, h10, h01, h11] = hermite(part);
                h00 * v0 + h10 * seconds * b0 + h01 * v1 + h11 * seconds * a1
            }
            Interpolation::CubicSpline => at(3 * key + 1, target),
            Interpolation::Linear if part > 0.0 => (1.0 - part) * at(key, target) + part * at(key + 1, target),
            _ => at(key, target),
        };
        (0..self.width).map(|target| weight(target) as f32).collect()
    }
}

/// The key before `time_s`, the position between it and the next key (0 to 1), and the seconds between the two.
fn span(times: &[f32], time_s: f32) -> (usize, f64, f64) {
    let after = times.partition_point(|t| *t <= time_s);
    if after == 0 || after == times.len() {
        return (after.saturating_sub(1), 0.0, 0.0);
    }
    let [from, to] = [times[after - 1], times[after]].map(f64::from);
    (after - 1, (f64::from(time_s) - from) / (to - from), to - from)
}

fn unit(q: DQuat) -> DQuat {
    if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
}

/// Weights of the two values and two tangents of a cubic Hermite spline (glTF 2.0, appendix C.5).
fn hermite(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2]
}
