//! One path: from the camera, with light sampled at every vertex and scattered rays weighed against it.
//!
//! What counts as a bounce: reflection and refraction, smooth or rough, do. Going straight on does not: through an alpha
//! blended or masked surface, or a smooth thin wall. Light seen directly or scattered once is *direct*; light scattered
//! n + 1 times has made n indirect bounces.

use glam::Vec3;

use super::bsdf::{self, Bsdf};
use super::bvh::Bvh;
use super::geometry::{Geometry, Point};
use super::lights::{Arrival, Lights};
use super::material::{Materials, Surface};
use super::sampler::Sampler;
use super::traversal::{Hit, Ray};
use crate::scene::{Pose, Scene};

/// Random numbers of vertex k: `LIGHT` of vertex 0 shares set 0 with the pixel; then two sets per vertex.
pub const PIXEL_AND_LIGHT: u32 = 0;
const OCCLUSION: u32 = u32::MAX;

/// Vertices after which paths may end at random as they darken, and after which even undiminished ones do: a path may be
/// held by clear glass for ever.
const ROULETTE_START: u32 = 1;
const ROULETTE_ALWAYS: u32 = 64;

/// What one path found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    pub beauty: Vec3,
    pub direct: Vec3,
    /// The surface first seen; `None` is the sky.
    pub first: Option<First>,
    /// Share of the cosine-weighted hemisphere that is open; 1 on the sky. 0 unless asked for.
    pub ao: f32,
    /// See [`crate::layers::Aov::Diffuse`].
    pub diffuse: f32,
}

/// The surface first seen.
#[derive(Clone, Copy, Debug)]
pub struct First {
    pub normal: Vec3,
    pub albedo: Vec3,
    /// Units along the ray.
    pub distance: f32,
}

/// A posed scene, ready to trace.
pub struct Integrator<'a> {
    pub geometry: Geometry<'a>,
    materials: Materials<'a>,
    bvh: Bvh,
    pub(super) lights: Lights,
    /// Indirect bounces.
    pub(super) bounces: u32,
    /// Whether to trace ambient occlusion.
    occlusion: bool,
}

/// A hit with everything about it.
pub(super) struct Vertex {
    pub hit: Hit,
    pub point: Point,
    pub surface: Surface,
    pub bsdf: Bsdf,
    /// The triangle's normal on the viewer's side.
    pub geometric: Vec3,
    /// Share of light that goes straight on.
    straight: Vec3,
    /// Whether the ray met nothing before that lets light straight through, nor does the vertex.
    pub clear: bool,
}

/// What a path carries along.
pub(super) struct Path {
    pub ray: Ray,
    pub throughput: Vec3,
    /// Vertices that scattered so far.
    pub scattered: u32,
    /// Density of the ray's direction; `None` if light sampling could not have chosen it.
    pub density: Option<f32>,
    /// Product of [`bsdf::Scatter::compression`].
    pub compression: f32,
    pub sample: Sample,
}

impl<'a> Integrator<'a> {
    /// `bounces` counts indirect ones; `u32::MAX` is full light.
    pub fn new(scene: &'a Scene, pose: &Pose, bounces: u32, occlusion: bool) -> Self {
        let geometry = Geometry::new(scene, pose);
        let materials = Materials::new(scene);
        let lights = Lights::new(&geometry, &materials, pose);
        Self { bvh: Bvh::new(&geometry.triangles), geometry, materials, lights, bounces, occlusion }
    }

    /// Follows a path from where its ray hits until it ends.
    pub(super) fn follow(&self, path: &mut Path, sampler: &mut Sampler) {
        while let Some(vertex) = self.advance(path, sampler) {
            self.emitted(path, &vertex);
            if !self.continues(path, &vertex) {
                break;
            }
            self.lit(path, &vertex, sampler);
            if self.scatter(path, &vertex, sampler).is_none() {
                break;
            }
        }
    }

    /// Whether a vertex scatters light that still counts.
    pub(super) fn continues(&self, path: &Path, vertex: &Vertex) -> bool {
        !vertex.surface.params.unlit && path.scattered <= self.bounces && (!vertex.hit.back || self.two_sided(vertex))
    }

    fn two_sided(&self, vertex: &Vertex) -> bool {
        let t = self.geometry.traits[vertex.point.material];
        t.double_sided || t.volume
    }

    /// Follows the path's ray to the next surface that does not let it straight through. `None`: the sky, whose light it adds.
    pub(super) fn advance(&self, path: &mut Path, sampler: &mut Sampler) -> Option<Vertex> {
        let (mut travelled, mut clear) = (0.0, true);
        // What of `Sample::diffuse` is still to be seen.
        let mut unseen = if path.scattered == 0 { 1.0 } else { 0.0 };
        loop {
            let Some(hit) = self.hit(&path.ray, path.scattered == 0) else {
                path.add(self.lights.sky);
                return None;
            };
            travelled += hit.t;
            let mut vertex = self.vertex(&path.ray, hit);
            if hit.back && self.geometry.traits[vertex.point.material].volume {
                path.throughput *= vertex.surface.params.transmittance(hit.t * self.geometry.units.size as f32);
            }
            let pass = vertex.straight.max_element();
            if pass > 0.0 {
                clear = false;
                if sampler.event() < pass {
                    // Blending shows what lies behind as the first surface; thin glass is one itself.
                    let blended = ((1.0 - vertex.surface.params.opacity) / pass).min(1.0);
                    path.sample.diffuse += unseen * (1.0 - blended) * vertex.surface.params.diffuse_share();
                    unseen *= blended;
                    path.throughput *= vertex.straight / pass;
                    path.ray.origin = self.leave(&vertex, path.ray.direction);
                    path.ray.near = 0.0;
                    path.ray.far -= hit.t;
                    continue;
                }
                path.throughput *= vertex.surface.params.opacity / (1.0 - pass);
            }
            vertex.hit.t = travelled;
            vertex.clear = clear;
            path.sample.diffuse += unseen * vertex.surface.params.diffuse_share();
            if path.scattered == 0 {
                self.first_seen(path, &vertex, sampler);
            }
            return Some(vertex);
        }
    }

    /// The nearest hit that counts. From the camera, the back of a single-sided surface is not there.
    fn hit(&self, ray: &Ray, camera: bool) -> Option<Hit> {
        let geometry = &self.geometry;
        self.bvh.nearest(ray, |hit| {
            let t = geometry.traits[geometry.material(hit.triangle)];
            (!camera || !hit.back || t.double_sided || t.volume)
                && (!t.masked || self.materials.opacity(geometry, hit.triangle, hit.u, hit.v) > 0.0)
        })
    }

    fn vertex(&self, ray: &Ray, hit: Hit) -> Vertex {
        let (texturing, material) = self.geometry.texturing(hit.triangle, hit.u, hit.v);
        self.materials.announce(&texturing, material);
        let point = self.geometry.point(hit.triangle, hit.u, hit.v, texturing);
        let surface = self.materials.surface(&point, hit.back);
        let side = if hit.back { -1.0 } else { 1.0 };
        let (geometric, wo) = (point.geometric * side, -ray.direction);
        let normal = facing(surface.normal * side, geometric, wo);
        let bsdf = Bsdf::new(&surface.params, self.geometry.traits[point.material].volume, normal, wo, hit.back);
        let straight = bsdf.straight() * surface.params.opacity + (1.0 - surface.params.opacity);
        Vertex { hit, point, surface, bsdf, geometric, straight, clear: true }
    }

    /// Where a ray in `direction` leaves a vertex: a little off the surface, so that it does not meet it again.
    pub(super) fn leave(&self, vertex: &Vertex, direction: Vec3) -> Vec3 {
        let p = vertex.point.position;
        // A few times the spacing of f32 at the position; 16 units stand for the sizes that cancel near the centre.
        let offset = 2e-6 * (p.abs().max_element() + 16.0);
        p + vertex.geometric * offset.copysign(vertex.geometric.dot(direction))
    }

    fn first_seen(&self, path: &mut Path, vertex: &Vertex, sampler: &Sampler) {
        let side = if vertex.hit.back { -1.0 } else { 1.0 };
        path.sample.first = Some(First {
            normal: vertex.surface.normal * side,
            albedo: vertex.surface.params.base_color,
            distance: vertex.hit.t,
        });
        if self.occlusion {
            let [u, v, ..] = sampler.set(OCCLUSION);
            let direction = bsdf::frame(vertex.geometric) * bsdf::sample_cosine([u, v]);
            let open = self.transmittance(vertex, direction, None);
            path.sample.ao = open.element_sum() / 3.0;
        }
    }

    /// Emission at a vertex, weighed against having been found by light sampling.
    pub(super) fn emitted(&self, path: &mut Path, vertex: &Vertex) {
        if vertex.surface.params.unlit {
            if path.scattered == 0 {
                path.add(vertex.surface.params.base_color);
            }
            return;
        }
        if vertex.surface.emission == Vec3::ZERO {
            return;
        }
        let weight = path.density.map_or(1.0, |density| {
            let cos = vertex.point.geometric.dot(path.ray.direction);
            weight(density, self.lights.emitter_density(vertex.hit.triangle, vertex.hit.t, cos))
        });
        path.add(vertex.surface.emission * weight);
    }

    /// Light sampled at a vertex.
    pub(super) fn lit(&self, path: &mut Path, vertex: &Vertex, sampler: &Sampler) {
        let k = path.scattered;
        let mut light = Vec3::ZERO;
        for arrival in self.arrivals(vertex.point.position, k, sampler) {
            let (f, density) = vertex.evaluate(arrival.direction);
            let arriving = f * arrival.weighted(density);
            if arriving != Vec3::ZERO {
                light += arriving * self.transmittance(vertex, arrival.direction, arrival.end);
            }
        }
        let light = path.throughput * light;
        path.sample.beauty += light;
        if k == 0 {
            path.sample.direct += light;
        }
    }

    /// Light that could arrive at vertex `k` of a path: one choice among the lamps, one among the emitters.
    pub(super) fn arrivals(&self, p: Vec3, k: u32, sampler: &Sampler) -> impl Iterator<Item = Arrival> {
        let [_, _, u, v] = sampler.set(if k == 0 { PIXEL_AND_LIGHT } else { 2 * k - 1 });
        let lamp = self.lights.lamp_at(p, || sampler.set(2 * k + 2)[2], [u, v]);
        let emitter = self.lights.emitter_at(&self.geometry, &self.materials, p, [u, v]);
        lamp.into_iter().chain(emitter)
    }

    /// The share of light that reaches a vertex from `end`, or along `direction` from infinity.
    pub(super) fn transmittance(&self, vertex: &Vertex, direction: Vec3, end: Option<Vec3>) -> Vec3 {
        let origin = self.leave(vertex, direction);
        let ray = match end {
            None => Ray { origin, direction, near: 0.0, far: f32::INFINITY },
            Some(end) => {
                let to = end - origin;
                let far = to.length();
                Ray { origin, direction: to / far.max(f32::MIN_POSITIVE), near: 0.0, far }
            }
        };
        let mut share = Vec3::ONE;
        let geometry = &self.geometry;
        let blocked = self.bvh.any(&ray, |hit| {
            let t = geometry.traits[geometry.material(hit.triangle)];
            if t.sheer {
                share *= self.vertex(&ray, *hit).straight;
                share == Vec3::ZERO
            } else {
                !t.masked || self.materials.opacity(geometry, hit.triangle, hit.u, hit.v) > 0.0
            }
        });
        if blocked { Vec3::ZERO } else { share }
    }

    /// The ray between two vertices, `direction` being the way from the first to the second.
    pub(super) fn between(&self, from: &Vertex, to: &Vertex, direction: Vec3) -> Ray {
        let origin = self.leave(from, direction);
        let way = self.leave(to, -direction) - origin;
        let far = way.length();
        Ray { origin, direction: way / far.max(f32::MIN_POSITIVE), near: 0.0, far }
    }

    /// On which of up to eight rays something stands, bit by bit: whatever it lets through.
    pub(super) fn blocked(&self, rays: &[Ray]) -> u32 {
        self.bvh.any_of(rays, |hit| {
            let masked = self.geometry.traits[self.geometry.material(hit.triangle)].masked;
            !masked || self.materials.opacity(&self.geometry, hit.triangle, hit.u, hit.v) > 0.0
        })
    }

    /// Sends the path on, and says with what probability roulette let it live, which is in its throughput. `None`: it ends.
    pub(super) fn scatter(&self, path: &mut Path, vertex: &Vertex, sampler: &Sampler) -> Option<f32> {
        let k = path.scattered;
        if k >= self.bounces && !self.lights.can_be_hit() {
            return None;
        }
        let [u, v, _, _] = sampler.set(2 * k + 1);
        let [lobe, roulette, ..] = sampler.set(2 * k + 2);
        let scatter = vertex.bsdf.sample(lobe, [u, v])?;
        if !vertex.consistent(scatter.direction) {
            return None;
        }
        path.throughput *= scatter.weight;
        path.compression *= scatter.compression;
        let mut survive = 1.0;
        if k >= ROULETTE_START {
            let cap = if k < ROULETTE_ALWAYS { 1.0 } else { 0.95 };
            survive = (path.throughput.max_element() / path.compression).min(cap);
            if roulette >= survive {
                return None;
            }
            path.throughput /= survive;
        }
        path.scattered += 1;
        path.density = (!scatter.mirror).then_some(scatter.density);
        path.ray = Ray {
            origin: self.leave(vertex, scatter.direction),
            direction: scatter.direction,
            near: 0.0,
            far: f32::INFINITY,
        };
        (path.throughput != Vec3::ZERO).then_some(survive)
    }
}

impl Arrival {
    /// Radiance over density, weighed against scattering that would have chosen the direction with density `scattered`.
    pub(super) fn weighted(&self, scattered: f32) -> Vec3 {
        self.radiance * self.density.map_or(1.0, |density| weight(density, scattered))
    }
}

impl Path {
    pub(super) fn new(ray: Ray) -> Self {
        let sample = Sample { ao: 1.0, ..Sample::default() };
        Self { ray, throughput: Vec3::ONE, scattered: 0, density: None, compression: 1.0, sample }
    }

    /// Light that the path's ray found.
    fn add(&mut self, radiance: Vec3) {
        let light = self.throughput * radiance;
        self.sample.beauty += light;
        if self.scattered <= 1 {
            self.sample.direct += light;
        }
    }
}

impl Vertex {
    pub(super) fn evaluate(&self, wi: Vec3) -> (Vec3, f32) {
        evaluate(&self.bsdf, self.geometric, wi)
    }

    /// Whether a direction lies on the same side of the triangle as of the shading normal: else light would leak through.
    fn consistent(&self, wi: Vec3) -> bool {
        consistent(&self.bsdf, self.geometric, wi)
    }

    /// How the surface scatters light to another viewer on the same side, in unit direction `wo`.
    pub(super) fn seen_from(&self, wo: Vec3) -> Bsdf {
        if self.bsdf.is_lambertian() && self.bsdf.normal().dot(wo) > 0.0 {
            return self.bsdf;
        }
        let side = if self.hit.back { -1.0 } else { 1.0 };
        Bsdf::new(
            &self.surface.params,
            false,
            facing(self.surface.normal * side, self.geometric, wo),
            wo,
            self.hit.back,
        )
    }
}

fn consistent(bsdf: &Bsdf, geometric: Vec3, wi: Vec3) -> bool {
    (geometric.dot(wi) > 0.0) == (bsdf.normal().dot(wi) > 0.0)
}

/// f · |cos| and density, where [`Vertex::consistent`].
pub(super) fn evaluate(bsdf: &Bsdf, geometric: Vec3, wi: Vec3) -> (Vec3, f32) {
    if consistent(bsdf, geometric, wi) { bsdf.eval(wi) } else { (Vec3::ZERO, 0.0) }
}

/// Veach's power heuristic, for the strategy whose density is `a`.
pub(super) fn weight(a: f32, b: f32) -> f32 {
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

/// The shading normal, bent towards the viewer where he would see it from behind.
fn facing(normal: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    const LEAST: f32 = 1e-3;
    let cos = normal.dot(wo);
    if cos >= LEAST {
        return normal;
    }
    let bent = (normal + wo * (LEAST - cos)).normalize();
    if bent.dot(wo) > 0.0 { bent } else { geometric }
}
