//! Light sampling: punctual lights (with or without a radius), emissive triangles chosen by power, and the sky's map.

use glam::Vec3;

use super::bsdf::frame;
use super::geometry::{Geometry, Location};
use super::material::Materials;
use super::sky::{Sky, choose};
use crate::scene::surface::{range_window, spot_falloff};
use crate::scene::{LightKind, Material, Pose, Scene};

/// A sampled light at a point, without occlusion.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Towards the light, unit.
    pub direction: Vec3,
    /// The end of the shadow ray; `None` is infinity.
    pub end: Option<Vec3>,
    /// Radiance over the density of this sample per steradian.
    pub radiance: Vec3,
    /// The density, for multiple importance sampling; `None` if scattered rays cannot hit the light.
    pub density: Option<f32>,
}

/// A light of KHR_lights_punctual, in units.
struct PunctualLight {
    kind: LightKind,
    position: Vec3,
    direction: Vec3,
    /// Irradiance × units²; for directional lights irradiance.
    intensity: Vec3,
    range: f32,
    /// Units; for directional lights the tangent of the half angle.
    radius: f32,
}

/// All lights of a posed scene.
pub struct Lights {
    punctual: Vec<PunctualLight>,
    emitters: Emitters,
    pub sky: Sky,
}

/// Emissive triangles and the cumulative distribution of their power.
#[derive(Default)]
struct Emitters {
    triangles: Vec<u32>,
    cumulative: Vec<f32>,
    /// Per triangle of the scene: the density of sampled points, per units². Empty without emitters.
    density: Vec<f32>,
}

impl Lights {
    pub fn new(materials: &Materials, pose: &Pose) -> Self {
        let geometry = &materials.geometry;
        let scene = geometry.scene;
        let punctual = (0..scene.lights.len()).map(|i| PunctualLight::new(scene, pose, geometry, i)).collect();
        Self { punctual, emitters: Emitters::new(materials), sky: Sky::new(scene) }
    }

    /// Whether scattered rays can hit any of the lights.
    pub fn can_be_hit(&self) -> bool {
        !self.emitters.triangles.is_empty() || self.sky.shines()
    }

    /// Samples one punctual light at `p`. `choice` selects it with probability proportional to its unoccluded
    /// irradiance.
    pub fn punctual_at(&self, p: Vec3, choice: impl FnOnce() -> f32, u: [f32; 2]) -> Option<LightSample> {
        match self.punctual.as_slice() {
            [] => None,
            [light] => light.sample(p, u),
            lights => {
                let total: f32 = lights.iter().map(|l| l.irradiance(p).max_element()).sum();
                let mut rest = choice() * total;
                let mut last = None;
                for light in lights {
                    let share = light.irradiance(p).max_element();
                    if share > 0.0 {
                        last = Some((light, share / total));
                        if rest < share {
                            break;
                        }
                        rest -= share;
                    }
                }
                let (light, probability) = last?;
                light.sample(p, u).map(|s| LightSample { radiance: s.radiance / probability, ..s })
            }
        }
    }

    /// Samples a point on the emissive triangles, seen from `p`.
    pub fn emitter_at(&self, materials: &Materials, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let (triangle, u) = self.emitters.choose(u)?;
        // Fold one half of the unit square onto the other.
        let (v, w) = if u[0] + u[1] > 1.0 { (1.0 - u[0], 1.0 - u[1]) } else { (u[0], u[1]) };
        let [p0, p1, p2] = materials.geometry.triangles[triangle as usize];
        let end = p0 * (1.0 - v - w) + p1 * v + p2 * w;
        let to = end - p;
        let distance2 = to.length_squared();
        let direction = to / distance2.sqrt();
        let cos = -(p1 - p0).cross(p2 - p0).normalize().dot(direction);
        if !(cos != 0.0 && distance2 > 0.0) {
            return None;
        }
        let emission = materials.emission_towards(Location { triangle, u: v, v: w }, cos < 0.0, -direction);
        let density = self.emitters.density[triangle as usize] * distance2 / cos.abs();
        (emission != Vec3::ZERO && density.is_finite()).then(|| LightSample {
            direction,
            end: Some(end + direction * (-SHORT * distance2.sqrt())),
            radiance: emission / density,
            density: Some(density),
        })
    }

    /// The density per steradian with which [`Self::emitter_at`] samples a point on `triangle` at `distance`; `cos` is
    /// between the direction and the triangle's normal.
    pub fn emitter_density(&self, triangle: u32, distance: f32, cos: f32) -> f32 {
        match self.emitters.density.get(triangle as usize) {
            Some(&d) if cos != 0.0 => d * distance * distance / cos.abs(),
            _ => 0.0,
        }
    }
}

/// The share of its length by which a shadow ray ends before an emitter's surface.
const SHORT: f32 = 1e-5;

impl PunctualLight {
    fn new(scene: &Scene, pose: &Pose, geometry: &Geometry, index: usize) -> Self {
        let (light, placed, units) = (&scene.lights[index], &pose.lights[index], &geometry.units);
        let local = light.kind != LightKind::Directional;
        Self {
            kind: light.kind,
            position: units.point(placed.position),
            direction: placed.direction.as_vec3().normalize_or(Vec3::NEG_Z),
            intensity: if local { light.intensity / (units.size * units.size) as f32 } else { light.intensity },
            range: units.length(light.range),
            radius: if local { units.length(light.radius) } else { light.radius },
        }
    }

    /// Unoccluded irradiance at `p` on a surface that faces the light.
    fn irradiance(&self, p: Vec3) -> Vec3 {
        if self.kind == LightKind::Directional {
            return self.intensity;
        }
        let to = self.position - p;
        let distance2 = to.length_squared();
        if distance2 == 0.0 {
            return Vec3::ZERO;
        }
        let distance = distance2.sqrt();
        let falloff = match self.kind {
            LightKind::Spot { inner, outer } => spot_falloff(-self.direction.dot(to) / distance, inner, outer),
            _ => 1.0,
        };
        self.intensity * (falloff * range_window(distance, self.range) / distance2)
    }

    /// Samples the light as seen from `p`. With a radius it is a ball of constant radiance (or a disc at infinity) with
    /// the same irradiance.
    fn sample(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let irradiance = self.irradiance(p);
        if irradiance == Vec3::ZERO {
            return None;
        }
        let radius2 = self.radius * self.radius;
        let (to, distance, sin2) = if self.kind == LightKind::Directional {
            (-self.direction, f32::INFINITY, radius2 / (1.0 + radius2))
        } else {
            let (to, distance) = (self.position - p).normalize_and_length();
            (to, distance, (self.radius / distance).powi(2).min(1.0))
        };
        let cos_max = (1.0 - sin2).sqrt();
        // 1 − cos, without cancellation.
        let versine = u[1] * sin2 / (1.0 + cos_max);
        let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
        let (s, c) = (std::f32::consts::TAU * u[0]).sin_cos();
        let direction = (frame(to) * Vec3::new(sin * c, sin * s, 1.0 - versine)).normalize();
        // A cone of uniform radiance L gives the irradiance E = L π sin². Its solid angle is 2π sin² / (1 + cos).
        let radiance = irradiance * (2.0 / (1.0 + cos_max));
        let along = (radius2 - distance * distance * (sin * sin)).max(0.0).sqrt();
        let reach = distance * (1.0 - versine) - along;
        let end = distance.is_finite().then(|| p + direction * reach.max(0.0));
        Some(LightSample { direction, end, radiance, density: None })
    }
}

impl Emitters {
    fn new(materials: &Materials) -> Self {
        let geometry = &materials.geometry;
        let is_emissive = |m: &Material| m.emissive != Vec3::ZERO && !m.unlit;
        let mut power = Vec::new();
        for triangle in 0..geometry.triangles.len() as u32 {
            if is_emissive(&geometry.materials[geometry.material(triangle)]) {
                let [a, b, c] = geometry.triangles[triangle as usize];
                let area = (b - a).cross(c - a).length() as f64 / 2.0;
                power.push((triangle, area, area * materials.mean_emission(triangle) as f64));
            }
        }
        let total: f64 = power.iter().map(|p| p.2).sum();
        if total <= 0.0 {
            return Self::default();
        }
        let mut emitters = Self { density: vec![0.0; geometry.triangles.len()], ..Self::default() };
        let mut sum = 0.0;
        for (triangle, area, power) in power.into_iter().filter(|p| p.2 > 0.0) {
            sum += power;
            emitters.triangles.push(triangle);
            emitters.cumulative.push((sum / total) as f32);
            emitters.density[triangle as usize] = (power / total / area) as f32;
        }
        emitters
    }

    /// Chooses a triangle by `u[0]` and rescales that number to [0, 1].
    fn choose(&self, u: [f32; 2]) -> Option<(u32, [f32; 2])> {
        (!self.triangles.is_empty()).then(|| {
            let (i, rest) = choose(&self.cumulative, u[0]);
            (self.triangles[i], [rest, u[1]])
        })
    }
}
