//! Axis-aligned boxes, the bounds of a scene over an animation, and triangle counts.

use std::borrow::Cow;
use std::collections::HashSet;

use glam::{BVec3, DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use super::{Bounds, Instance, Playback, Pose, Scene};

/// Uniform times at which [`Scene::bounds`] samples an animation, in addition to every key.
const UNIFORM_TIMES: usize = 64;
const TIMES_MAX: usize = 4096;
/// The number of nodes and moving instances, times the number of times, above which fewer times are sampled, but at
/// least [`TIMES_MIN`]. Sampling then takes about a second.
const PLACES_MAX: usize = 1 << 24;
const TIMES_MIN: usize = 8;
/// Up to this number of vertices × times every vertex is transformed, which takes about a second.
const VERTEX_SAMPLES_MAX: usize = 1 << 28;
/// Number of deforming vertices × times above which fewer times are sampled, because these vertices take longer.
const DEFORMED_SAMPLES_MAX: usize = 1 << 24;

impl Bounds {
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// The smallest box that contains both.
    fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box that also contains `point`.
    pub fn include(self, point: DVec3) -> Self {
        self.union(Self { min: point, max: point })
    }

    /// The origin for an empty box.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * (self.min + self.max) }
    }

    /// Zero for an empty box.
    pub fn size(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.max - self.min }
    }

    /// The radius of the sphere through the corners; 1 for a box without size.
    pub fn radius(&self) -> f64 {
        let radius = 0.5 * self.size().length();
        if radius > 0.0 { radius } else { 1.0 }
    }
}

/// The largest number of vertices that [`Scene::outline`] returns.
const OUTLINE_MAX: usize = 1 << 20;

impl Scene {
    /// Points that represent the extent of the scene: its vertices if nothing is animated and there are few enough,
    /// else the corners of `bounds`.
    pub fn outline(&self, bounds: Bounds) -> Vec<DVec3> {
        let vertices: usize = self.instances.iter().map(|instance| self.meshes[instance.mesh].positions.len()).sum();
        if !self.animations.is_empty() || vertices > OUTLINE_MAX {
            let corner = |i: u32| DVec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), bounds.max, bounds.min);
            return (0..8).map(corner).filter(|corner| corner.is_finite()).collect();
        }
        self.vertices(&self.pose(None, 0.0)).collect()
    }

    /// The vertices of all instances in the world, in metres.
    pub fn vertices<'a>(&'a self, pose: &'a Pose) -> impl Iterator<Item = DVec3> + 'a {
        self.instances.iter().zip(&pose.world_from_instance).flat_map(|(instance, place)| {
            let positions = self.meshes[instance.mesh].posed_positions(pose).into_owned();
            positions.into_iter().map(|p| place.transform_point3(p.as_dvec3()))
        })
    }

    /// The box around all vertices over the whole `animation`, in metres, sampled at its keys and at 64 uniform times.
    /// Motion between these times (the arc of a fast rotation) can leave the box slightly. Very long animations are
    /// sampled at 4096 uniform times, and at fewer if very many vertices move. Very large meshes are replaced by their
    /// boxes or, if they deform, sampled at fewer times. Empty for a scene without meshes.
    pub fn bounds(&self, animation: Option<usize>) -> Bounds {
        self.bounds_of(&Playback::once(animation))
    }

    /// The box of [`Self::bounds`] over all animations of `playback`, until the longest has ended, or for twice as long
    /// if it repeats.
    pub fn bounds_of(&self, playback: &Playback) -> Bounds {
        let moves = self.moving_nodes();
        let moved = |instance: &Instance| {
            moves[instance.node] || self.meshes[instance.mesh].deform.is_some() && !playback.animations.is_empty()
        };
        let moving: Vec<&Instance> = self.instances.iter().filter(|instance| moved(instance)).collect();
        let times = if moving.is_empty() { vec![] } else { self.sample_times(playback, moving.len()) };
        let points: Vec<Cow<[Vec3]>> =
            self.meshes.iter().map(|m| hull_points(&m.positions, times.len().max(1))).collect();
        let deforming = self.meshes.iter().filter_map(|mesh| mesh.deform.as_ref());
        let deformed: usize = deforming.map(|deform| deform.positions.len()).sum();
        let every = deformed.saturating_mul(times.len()).div_ceil(DEFORMED_SAMPLES_MAX).max(1);
        let include = |bounds: Bounds, instance: &Instance, world: &DAffine3, pose: &Pose| {
            let place = |p: &Vec3| world.transform_point3(p.as_dvec3());
            let mesh = &self.meshes[instance.mesh];
            match mesh.deform {
                Some(_) => mesh.posed_positions(pose).iter().map(place).fold(bounds, Bounds::include),
                None => points[instance.mesh].iter().map(place).fold(bounds, Bounds::include),
            }
        };
        let still = self.at_moment(playback, 0.0, |world, deforms| {
            let pose = Pose { deforms, ..Pose::default() };
            let still = self.instances.iter().filter(|instance| !moved(instance));
            still.fold(Bounds::EMPTY, |bounds, instance| include(bounds, instance, &self.place(instance, world), &pose))
        });
        let over = |numbered: &[(usize, f32)]| {
            let (mut bounds, mut last) = (Bounds::EMPTY, vec![None; moving.len()]);
            for &(number, time) in numbered {
                bounds = self.at_moment(playback, f64::from(time), |world, deforms| {
                    let (mut bounds, pose) = (bounds, Pose { deforms, ..Pose::default() });
                    for (instance, last) in moving.iter().zip(&mut last) {
                        let world = self.place(instance, world);
                        // Many instances are sampled at fewer times.
                        let shows = match self.meshes[instance.mesh].deform {
                            Some(_) => number.is_multiple_of(every),
                            None => *last != Some(world),
                        };
                        if shows {
                            bounds = include(bounds, instance, &world, &pose);
                        }
                        *last = Some(world);
                    }
                    bounds
                });
            }
            bounds
        };
        let numbered: Vec<(usize, f32)> = times.into_iter().enumerate().collect();
        let part = numbered.len().div_ceil(rayon::current_num_threads()).max(1);
        numbered.par_chunks(part).map(over).reduce(|| Bounds::EMPTY, Bounds::union).union(still)
    }

    /// `moving` is the number of instances that move.
    fn sample_times(&self, playback: &Playback, moving: usize) -> Vec<f32> {
        let most = (PLACES_MAX / (self.nodes.len() + moving)).clamp(TIMES_MIN, TIMES_MAX);
        let animations = || playback.animations.iter().filter_map(|&a| self.animations.get(a));
        let several = animations().count() > 1 && playback.repeats;
        let Some(longest) = animations().map(|a| a.duration).reduce(f32::max) else { return vec![0.0] };
        // Animations of different lengths combine differently in each repetition.
        let duration = if several { 2.0 * longest } else { longest };
        let uniform = |n: usize| (0..=n).map(move |i| duration * i as f32 / n as f32);
        // Many channels share their times.
        let mut times: HashSet<u32> = uniform(UNIFORM_TIMES.min(most)).map(f32::to_bits).collect();
        let mut last = f32::NAN;
        let keys = animations().flat_map(|a| {
            let weights = a.weights.iter().flat_map(|c| &c.times);
            a.channels.iter().flat_map(|c| &c.times).chain(weights)
        });
        for &key in keys {
            // Damaged files can have millions of equal times.
            if key != last {
                times.insert(key.to_bits());
            }
            last = key;
            if times.len() > most {
                return uniform(most).collect();
            }
        }
        let mut times: Vec<f32> = times.into_iter().map(f32::from_bits).collect();
        times.sort_by(f32::total_cmp);
        times
    }

    /// The number of triangles of all instances.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|i| self.meshes[i.mesh].indices.len() / 3).sum()
    }

    /// The number of triangles of all instances without area in world space at `pose`.
    pub fn degenerate_triangles(&self, pose: &Pose) -> usize {
        let count = |(instance, world): (&Instance, &DAffine3)| {
            let mesh = &self.meshes[instance.mesh];
            let positions = mesh.posed_positions(pose);
            let corner = |i: u32| world.transform_vector3(positions[i as usize].as_dvec3());
            let flat = |t: &&[u32]| {
                let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
                (b - a).cross(c - a) == DVec3::ZERO
            };
            mesh.indices.chunks_exact(3).filter(flat).count()
        };
        self.instances.iter().zip(&pose.world_from_instance).map(count).sum()
    }
}

/// Points whose bounds contain those of `positions` under any transform: the positions themselves, or their box's
/// corners.
fn hull_points(positions: &[Vec3], samples: usize) -> Cow<'_, [Vec3]> {
    if positions.len().saturating_mul(samples) <= VERTEX_SAMPLES_MAX {
        return Cow::Borrowed(positions);
    }
    let min = positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let max = positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
    let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), max, min);
    Cow::Owned((0..8).map(corner).collect())
}
