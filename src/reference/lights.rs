//! What lights the scene: lamps without extent (or with a small radius), and emissive triangles chosen by power.
//! The constant sky is found by scattered rays alone: for a diffuse surface they already follow its irradiance.

use glam::Vec3;

use super::bsdf::frame;
use super::geometry::Geometry;
use super::material::Materials;
use crate::scene::surface::{range_window, spot_falloff};
use crate::scene::{LightKind, Pose, Scene};

/// Light that would arrive at a point if nothing stood in between.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Towards the light, unit.
    pub direction: Vec3,
    /// Where the shadow ray ends; `None`: at infinity.
    pub end: Option<Vec3>,
    /// Radiance over the density of this choice, per steradian.
    pub radiance: Vec3,
    /// The density, for weighing against scattered rays; `None` where those cannot find the light.
    pub density: Option<f32>,
}

/// A lamp, in units.
struct Lamp {
    kind: LightKind,
    position: Vec3,
    direction: Vec3,
    /// Irradiance × units², or irradiance.
    intensity: Vec3,
    range: f32,
    /// Units; for directional lamps the tangent of the half angle.
    radius: f32,
}

/// Every light of a posed scene.
pub struct Lights {
    lamps: Vec<Lamp>,
    emitters: Emitters,
    pub sky: Vec3,
}

/// Emissive triangles and the running sum of their share of the power.
#[derive(Default)]
struct Emitters {
    triangles: Vec<u32>,
    cumulative: Vec<f32>,
    /// Per triangle of the scene: the density of its points, per units². Empty without emitters.
    density: Vec<f32>,
}

impl Lights {
    pub fn new(geometry: &Geometry, materials: &Materials, pose: &Pose) -> Self {
        let scene = geometry.scene;
        let lamps = (0..scene.lights.len()).map(|i| Lamp::new(scene, pose, geometry, i)).collect();
        Self { lamps, emitters: Emitters::new(geometry, materials), sky: scene.sky }
    }

    /// Whether scattered rays can find light at all.
    pub fn can_be_hit(&self) -> bool {
        !self.emitters.triangles.is_empty() || self.sky != Vec3::ZERO
    }

    /// Light at `p` from one lamp, chosen by `choice` among those that reach `p`, by how much they could give.
    pub fn lamp_at(&self, p: Vec3, choice: impl FnOnce() -> f32, u: [f32; 2]) -> Option<Arrival> {
        match self.lamps.as_slice() {
            [] => None,
            [lamp] => lamp.arrival(p, u),
            lamps => {
                let total: f32 = lamps.iter().map(|l| l.irradiance(p).max_element()).sum();
                let mut rest = choice() * total;
                let mut last = None;
                for lamp in lamps {
                    let share = lamp.irradiance(p).max_element();
                    if share > 0.0 {
                        last = Some((lamp, share / total));
                        if rest < share {
                            break;
                        }
                        rest -= share;
                    }
                }
                let (lamp, probability) = last?;
                lamp.arrival(p, u).map(|a| Arrival { radiance: a.radiance / probability, ..a })
            }
        }
    }

    /// Light at `p` from a point on the emissive triangles.
    pub fn emitter_at(&self, geometry: &Geometry, materials: &Materials, p: Vec3, u: [f32; 2]) -> Option<Arrival> {
        let (triangle, u) = self.emitters.choose(u)?;
        // The square's far half folds onto the near one.
        let (b, c) = if u[0] + u[1] > 1.0 { (1.0 - u[0], 1.0 - u[1]) } else { (u[0], u[1]) };
        let [p0, p1, p2] = geometry.triangles[triangle as usize];
        let end = p0 * (1.0 - b - c) + p1 * b + p2 * c;
        let to = end - p;
        let distance2 = to.length_squared();
        let direction = to / distance2.sqrt();
        let cos = -(p1 - p0).cross(p2 - p0).normalize().dot(direction);
        if !(cos != 0.0 && distance2 > 0.0) {
            return None;
        }
        let emission = materials.emission(geometry, triangle, b, c, cos < 0.0);
        let density = self.emitters.density[triangle as usize] * distance2 / cos.abs();
        (emission != Vec3::ZERO && density.is_finite()).then(|| Arrival {
            direction,
            end: Some(end + direction * (-SHORT * distance2.sqrt())),
            radiance: emission / density,
            density: Some(density),
        })
    }

    /// Density per steradian with which [`Self::emitter_at`] finds a point on `triangle`, seen at `distance` under
    /// `cos` to the triangle's normal.
    pub fn emitter_density(&self, triangle: u32, distance: f32, cos: f32) -> f32 {
        match self.emitters.density.get(triangle as usize) {
            Some(&d) if cos != 0.0 => d * distance * distance / cos.abs(),
            _ => 0.0,
        }
    }
}

/// Shadow rays stop this share of their length before an emitter's surface.
const SHORT: f32 = 1e-5;

impl Lamp {
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

    /// Irradiance at `p` on a surface that faces the lamp.
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

    /// A lamp with a radius is an evenly bright ball (or, far away, disc) that sends the same light in total.
    fn arrival(&self, p: Vec3, u: [f32; 2]) -> Option<Arrival> {
        let irradiance = self.irradiance(p);
        if irradiance == Vec3::ZERO {
            return None;
        }
        let (to, distance) = match self.kind {
            LightKind::Directional => (-self.direction, f32::INFINITY),
            _ => ((self.position - p).normalize(), (self.position - p).length()),
        };
        let sin2 = match self.kind {
            LightKind::Directional => self.radius * self.radius / (1.0 + self.radius * self.radius),
            _ => (self.radius / distance).powi(2).min(1.0),
        };
        let cos_max = (1.0 - sin2).sqrt();
        // 1 − cos, without the cancellation.
        let lift = u[1] * sin2 / (1.0 + cos_max);
        let sin = (lift * (2.0 - lift)).max(0.0).sqrt();
        let (s, c) = (std::f32::consts::TAU * u[0]).sin_cos();
        let direction = (frame(to) * Vec3::new(sin * c, sin * s, 1.0 - lift)).normalize();
        // Irradiance E from a cone of even radiance L: E = L π sin². Its solid angle: 2π sin² / (1 + cos).
        let radiance = irradiance * (2.0 / (1.0 + cos_max));
        let along = (self.radius * self.radius - distance * distance * (sin * sin)).max(0.0).sqrt();
        let reach = distance * (1.0 - lift) - along;
        let end = distance.is_finite().then(|| p + direction * reach.max(0.0));
        Some(Arrival { direction, end, radiance, density: None })
    }
}

impl Emitters {
    fn new(geometry: &Geometry, materials: &Materials) -> Self {
        let mut power = Vec::new();
        for triangle in 0..geometry.triangles.len() as u32 {
            if materials.is_emissive(geometry.material(triangle)) {
                let [a, b, c] = geometry.triangles[triangle as usize];
                let area = (b - a).cross(c - a).length() as f64 / 2.0;
                power.push((triangle, area, area * materials.mean_emission(geometry, triangle) as f64));
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

    /// A triangle, and the random numbers made even again.
    fn choose(&self, u: [f32; 2]) -> Option<(u32, [f32; 2])> {
        let last = self.triangles.len().checked_sub(1)?;
        let i = self.cumulative.partition_point(|&c| c <= u[0]).min(last);
        let start = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        let rest = ((u[0] - start) / (self.cumulative[i] - start)).clamp(0.0, 1.0);
        Some((self.triangles[i], [rest, u[1]]))
    }
}
