//! Twin of the cone tracers: a cone through a volume, a shadow cone, and a gather with a set of them.

use glam::{Vec3, Vec4};

use super::directions::{SetCone, cone_set, tangent_frame};
use super::volume::{ISOTROPIC, Volume};
use twobounce::gi::cones::choices::{Blend, Form, Weights};
use twobounce::gi::cones::{Ledger, Settings};

/// Alpha at which a cone ends (D18): the rest cannot change an 8-bit image.
pub const OPAQUE: f32 = 0.995;
/// Largest alpha that has an optical depth: −ln(1 − 0.9999) = 9.2.
pub const MAX_ALPHA: f32 = 0.9999;
/// The largest number of steps of a cone (D18).
pub const MAX_STEPS: usize = 2048;

/// A cone in volume space.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Tangent of the half angle.
    pub aperture: f32,
    /// Distance of the first sample along the cone.
    pub start: f32,
    /// The largest distance along the cone.
    pub end: f32,
}

/// Light and opacity that a cone met.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// Premultiplied radiance, and alpha.
    pub value: Vec4,
    /// Distance from the cone's origin and mip level of every step.
    pub look_ups: Vec<[f32; 2]>,
}

/// The weights of the three facing volumes: d² (sums to 1), |d| over its sum, or |d| (sums to 1…√3). `extinction`
/// weighs optical depths with |d|.
pub fn direction_weights(direction: Vec3, weights: Weights) -> Vec3 {
    let d = direction.abs();
    match weights {
        Weights::D2 => d * d,
        Weights::Norm1 => d / d.element_sum(),
        Weights::Abs | Weights::Extinction => d,
    }
}

/// Diameter of a cone at distance `s`: 2ts, and one voxel at least.
/// D17 printed: max(1/N, 2t)·s, a length compared with a ratio, and half a voxel at least.
pub fn cone_diameter(aperture: f32, s: f32, edge: u32, d17: Form) -> f32 {
    let voxel = 1.0 / edge as f32;
    match d17 {
        Form::Printed => f32::max(0.5 * voxel, f32::max(voxel, 2.0 * aperture) * s),
        Form::Right => f32::max(voxel, 2.0 * aperture * s),
    }
}

/// Alpha of a step that is `steps` edges of the sampled level long: 1 − (1 − a)^steps.
pub fn opacity_correction(alpha: f32, steps: f32) -> f32 {
    1.0 - (1.0 - alpha).max(0.0).powf(steps)
}

/// Distance from `origin` along `direction` to where the cube `[0, 1]³` is left; 0 where it lies behind.
pub fn exit_distance(origin: Vec3, direction: Vec3) -> f32 {
    let to_planes = (Vec3::select(direction.cmpgt(Vec3::ZERO), Vec3::ONE, Vec3::ZERO) - origin) / direction;
    Vec3::select(direction.cmpeq(Vec3::ZERO), Vec3::INFINITY, to_planes).min_element().max(0.0)
}

/// Whether a point lies in `[0, 1]³`, its surface included (D14).
pub fn is_inside_cube(position: Vec3) -> bool {
    position.cmpge(Vec3::ZERO).all() && position.cmple(Vec3::ONE).all()
}

/// The length of a cone. D10 printed: √2 at most; right: to the exit from the cube. D11 right: never beyond that exit.
fn reach(cone: &Cone, ledger: &Ledger) -> f32 {
    let diagonal = if ledger.d10 == Form::Printed { std::f32::consts::SQRT_2 } else { f32::INFINITY };
    let both_printed = ledger.d10 == Form::Printed && ledger.d11 == Form::Printed;
    let exit = if both_printed { f32::INFINITY } else { exit_distance(cone.origin, cone.direction) };
    cone.end.min(diagonal).min(exit)
}

/// Alpha at which a cone ends. D18 printed: exactly 1; right: [`OPAQUE`].
fn stop_alpha(d18: Form) -> f32 {
    if d18 == Form::Printed { 1.0 } else { OPAQUE }
}

/// The volume as seen by a traveller along `direction` over `step`, at a mip level whose edge is `edge`.
fn sample_volume(
    volume: &Volume,
    position: Vec3,
    direction: Vec3,
    level: f32,
    step_in_edges: f32,
    s: &Settings,
) -> Vec4 {
    let w = direction_weights(direction, s.weights).to_array();
    let d = direction.to_array();
    let faces: [Vec4; 3] = std::array::from_fn(|axis| {
        volume.sample(if d[axis] < 0.0 { axis + 3 } else { axis }, position, level, s.address_mode())
    });
    if s.weights == Weights::Extinction {
        let depth = |axis: usize| -w[axis] * (1.0 - faces[axis].w.clamp(0.0, MAX_ALPHA)).ln();
        let total = depth(0) + depth(1) + depth(2);
        if total <= 0.0 {
            return Vec4::ZERO;
        }
        let colour: Vec3 = (0..3).map(|i| faces[i].truncate() * (depth(i) / faces[i].w.max(1e-6))).sum();
        let alpha = 1.0 - (-total * step_in_edges).exp();
        return (colour * (alpha / total)).extend(alpha);
    }
    let sample: Vec4 = (0..3).map(|i| faces[i] * w[i]).sum();
    if step_in_edges == 1.0 || sample.w <= 0.0 {
        return sample;
    }
    sample * (opacity_correction(sample.w.min(1.0), step_in_edges) / sample.w)
}

/// Front to back through the volume, in steps of the cone's diameter: `acc += (1 − acc.a) · sample` at level
/// log2(diameter · N). Twin of `trace_cone`.
pub fn trace_cone(volume: &Volume, cone: &Cone, s: &Settings) -> Traced {
    let (edge, end) = (volume.edge(), reach(cone, &s.ledger));
    let voxel = 1.0 / edge as f32;
    let (mut value, mut look_ups, mut distance) = (Vec4::ZERO, vec![], cone.start);
    while value.w < stop_alpha(s.ledger.d18) && look_ups.len() < MAX_STEPS {
        let diameter = cone_diameter(cone.aperture, distance, edge, s.ledger.d17);
        // A sum continues until the last wall, cut by the border, has been read whole.
        let margin = if s.blend == Blend::Sum { 0.5 * voxel + (s.exit_margin * diameter).min(0.125) } else { 0.0 };
        if distance >= end + margin {
            break;
        }
        let level = (diameter * edge as f32).log2().max(0.0);
        let position = cone.origin + distance * cone.direction;
        if s.blend == Blend::Sum {
            let seen = s.step * sample_volume(volume, position, cone.direction, level, 1.0, s);
            value += seen * f32::min(1.0, (1.0 - value.w) / seen.w.max(1e-6));
        } else {
            value += (1.0 - value.w) * sample_volume(volume, position, cone.direction, level, s.step, s);
        }
        look_ups.push([distance, level]);
        distance += diameter.max(voxel) * s.step;
    }
    Traced { value: value.max(Vec4::ZERO), look_ups }
}

/// Share of a light at `to` that reaches `from`, 1 is all of it. The cone starts off the surface as [`Settings::start`]
/// says; `jitter` in `[0, 1)` is a share of one step. Twin of `trace_shadow_cone`.
pub fn trace_shadow_cone(
    volume: &Volume,
    from: Vec3,
    normal: Vec3,
    to: Vec3,
    aperture: f32,
    jitter: f32,
    s: &Settings,
) -> f32 {
    let (edge, ledger) = (volume.edge(), &s.ledger);
    let voxel = 1.0 / edge as f32;
    let origin = from + normal * (s.start.shadow_normal * voxel);
    let to_light = to - origin;
    let length = to_light.length();
    // D16: a light on the surface has no direction (the listing divides 0 by 0).
    if length <= s.start.shadow_end * voxel {
        return 1.0;
    }
    let direction = to_light / length;
    let cone = Cone { origin, direction, aperture, start: 0.0, end: length - s.start.shadow_end * voxel };
    let end = reach(&cone, ledger);
    let mut distance = (s.start.shadow_along + jitter * s.shadow_step) * voxel;
    let (mut alpha, mut steps) = (0.0, 0);
    while alpha < stop_alpha(ledger.d18) && distance < end && steps < MAX_STEPS {
        let position = origin + distance * direction;
        if !is_inside_cube(position) {
            break;
        }
        let diameter = cone_diameter(aperture, distance, edge, ledger.d17);
        let step = diameter.max(voxel) * s.shadow_step;
        alpha += (1.0 - alpha) * shadow_sample(volume, position, direction, diameter, step, s);
        distance += step;
        steps += 1;
    }
    (1.0 - alpha).clamp(0.0, 1.0)
}

/// Alpha of one step of a shadow cone. Printed: D12 a short step counts as a whole one, D13 the level is
/// log2(diameter·N + 1), D15 the isotropic volume.
fn shadow_sample(volume: &Volume, position: Vec3, direction: Vec3, diameter: f32, step: f32, s: &Settings) -> f32 {
    let ledger = &s.ledger;
    let width = diameter * volume.edge() as f32;
    let level = if ledger.d13 == Form::Printed { (width + 1.0).log2() } else { width.log2() }.max(0.0);
    let in_edges = if ledger.d12 == Form::Printed { 1.0 } else { step * volume.edge() as f32 / level.exp2() };
    if ledger.d15 == Form::Right {
        return sample_volume(volume, position, direction, level, in_edges, s).w.clamp(0.0, 1.0);
    }
    opacity_correction(volume.sample(ISOTROPIC, position, level, s.address_mode()).w.clamp(0.0, 1.0), in_edges)
}

/// Light gathered over the hemisphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gathered {
    /// E/π: a Lambertian surface sends albedo times this.
    pub radiance: Vec3,
    /// Share of the hemisphere that the cones leave open, cosine-weighted: ambient occlusion.
    pub open: f32,
}

/// The set of diffuse cones around `normal` in a grid of `edge`³, each with its weight. The offset moves a cone's
/// origin, but does not change its width at the start. D19 printed: the offset is a share of the cube, namely as many
/// voxels of 128.
pub fn diffuse_cones(from: Vec3, normal: Vec3, edge: u32, s: &Settings) -> Vec<(Cone, f32)> {
    let voxel = 1.0 / edge as f32;
    let offset = s.start.diffuse_offset * if s.ledger.d19 == Form::Printed { 1.0 / 128.0 } else { voxel };
    let frame = tangent_frame(normal, s.ledger.d22);
    let cone = |c: SetCone| {
        let direction = frame * c.direction;
        let origin = from + normal * (s.start.diffuse_normal * voxel) + direction * offset;
        let start = s.start.diffuse_along * voxel;
        (Cone { origin, direction, aperture: c.aperture * s.aperture, start, end: 2.0 }, c.weight)
    };
    cone_set(s.set, s.ledger.d6, s.ledger.d26).into_iter().map(cone).collect()
}

/// Light that the diffuse cones gather; the sky shines through the share that their alpha leaves (D21 printed: it does
/// not).
pub fn gather_diffuse(volume: &Volume, from: Vec3, normal: Vec3, sky: Vec3, s: &Settings) -> Gathered {
    let mut sum = Gathered { radiance: Vec3::ZERO, open: 0.0 };
    for (cone, weight) in diffuse_cones(from, normal, volume.edge(), s) {
        let hit = trace_cone(volume, &cone, s).value;
        let open = (1.0 - hit.w).max(0.0);
        let sky = if s.ledger.d21 == Form::Printed { Vec3::ZERO } else { sky * open };
        sum.radiance += weight * (hit.truncate() + sky);
        sum.open += weight * open;
    }
    sum
}
