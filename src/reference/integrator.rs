//! Path tracing from the camera, with light sampling at every vertex and multiple importance sampling.
//!
//! Reflection and refraction, smooth or rough, count as bounces. Passing unscattered through an alpha-blended or masked
//! surface or a smooth thin wall does not. Light seen directly or scattered once is *direct*; scattered n + 1 times, it
//! has made n indirect bounces.

use glam::Vec3;

use super::bsdf::{self, Bsdf, Viewing};
use super::bvh::Bvh;
use super::geometry::{Geometry, Location, MaterialFlags, Point};
use super::lights::{LightSample, Lights};
use super::material::{Materials, Surface};
use super::sampler::Sampler;
use super::traversal::{Hit, Ray};
use super::{Depth, Options};
use crate::scene::finish::dispersed;
use crate::scene::{Material, Pose, Scene};

/// Set 0 of the random numbers: the place in the pixel and the light at vertex 0. Vertex k then uses set 2k + 1 for its
/// direction and for the light at vertex k + 1, and set 2k + 2 to choose a lobe, the path's end and a punctual light.
pub const PIXEL_AND_LIGHT: u32 = 0;
const OCCLUSION: u32 = u32::MAX;

/// Russian roulette starts after this number of vertices. After `ROULETTE_ALWAYS` vertices it also ends paths of
/// undiminished throughput, because total reflection in clear glass could continue forever.
const ROULETTE_START: u32 = 1;
const ROULETTE_ALWAYS: u32 = 64;

/// The result of one path.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    pub beauty: Vec3,
    pub direct: Vec3,
    /// The first visible surface; `None` is the sky.
    pub first: Option<FirstHit>,
    /// Unoccluded share of the cosine-weighted hemisphere; 1 on the sky and if occlusion is not traced.
    pub ao: f32,
    /// See [`crate::layers::Aov::Diffuse`].
    pub diffuse: f32,
}

/// The first visible surface.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    pub normal: Vec3,
    pub albedo: Vec3,
    /// Units along the ray.
    pub distance: f32,
}

/// A posed scene, ready to trace.
pub struct Integrator<'a> {
    materials: Materials<'a>,
    bvh: Bvh,
    pub(super) lights: Lights,
    /// The number of indirect bounces; `u32::MAX` is unlimited.
    pub(super) bounces: u32,
    /// Whether to trace ambient occlusion.
    occlusion: bool,
    /// See [`Scene::sky_unseen`].
    sky_unseen: bool,
}

/// A vertex of a path: a hit and the material there.
pub(super) struct Vertex {
    pub hit: Hit,
    pub point: Point,
    pub surface: Surface,
    pub bsdf: Bsdf,
    /// Share of light that passes the surface unscattered.
    unscattered: Vec3,
    /// Whether neither the vertex nor a surface on the way to it lets light pass unscattered.
    pub clear: bool,
}

/// The state of a path.
pub(super) struct Path {
    pub ray: Ray,
    pub throughput: Vec3,
    /// The number of vertices that scattered so far.
    pub scattered: u32,
    /// Density of the ray's direction; `None` for the camera ray and after mirrors, where light sampling does not
    /// apply.
    pub density: Option<f32>,
    /// Product of [`bsdf::Scatter::compression`].
    pub compression: f32,
    /// The remaining channel of the throughput, once a surface has dispersed the light.
    pub channel: Option<usize>,
    pub sample: Sample,
}

impl<'a> Integrator<'a> {
    pub fn new(scene: &'a Scene, pose: &Pose, options: &Options) -> Self {
        let materials = Materials::new(scene, pose);
        let bounces = match options.depth {
            Depth::Full => u32::MAX,
            Depth::Bounces(n) => n,
        };
        Self {
            bvh: Bvh::new(&materials.geometry.triangles),
            lights: Lights::new(&materials, pose),
            materials,
            bounces,
            occlusion: options.occlusion,
            sky_unseen: scene.sky_unseen,
        }
    }

    pub fn geometry(&self) -> &Geometry<'a> {
        &self.materials.geometry
    }

    /// Replaces the scene's materials by these, which emit the same light: the lights stay.
    pub fn show(&mut self, materials: &'a [Material]) {
        self.materials.geometry.show(materials);
    }

    /// The flags of the material at a hit.
    fn flags(&self, at: Location) -> MaterialFlags {
        self.geometry().flags[self.geometry().material(at.triangle)]
    }

    /// Traces a path until it ends.
    pub(super) fn follow(&self, path: &mut Path, sampler: &mut Sampler) {
        while let Some(vertex) = self.arrive(path, sampler) {
            self.add_sampled_light(path, &vertex, sampler);
            if self.scatter(path, &vertex, sampler).is_none() {
                break;
            }
        }
    }

    /// Follows the path from a vertex that it has reached until it ends.
    pub(super) fn follow_from(&self, vertex: &Vertex, path: &mut Path, sampler: &mut Sampler) {
        self.add_sampled_light(path, vertex, sampler);
        if self.scatter(path, vertex, sampler).is_some() {
            self.follow(path, sampler);
        }
    }

    /// [`Self::advance`], and adds the emission there. `None` if the path ends.
    #[inline(always)]
    pub(super) fn arrive(&self, path: &mut Path, sampler: &mut Sampler) -> Option<Vertex> {
        let vertex = self.advance(path, sampler)?;
        self.add_emission(path, &vertex);
        self.continues(path, &vertex).then_some(vertex)
    }

    /// Whether the path continues at a vertex.
    pub(super) fn continues(&self, path: &Path, vertex: &Vertex) -> bool {
        let flags = self.geometry().flags[vertex.point.material];
        let shows = !vertex.hit.back || flags.double_sided || flags.volume;
        !vertex.surface.params.unlit && path.scattered <= self.bounces && shows
    }

    /// Follows the path's ray to the next surface that it does not pass unscattered. Where it leaves the
    /// scene, it adds the sky's radiance and returns `None`.
    pub(super) fn advance(&self, path: &mut Path, sampler: &mut Sampler) -> Option<Vertex> {
        let (mut travelled, mut clear) = (0.0, true);
        // The share of the sample that shows surfaces farther along the ray, for `Sample::diffuse`.
        let mut remaining = if path.scattered == 0 { 1.0 } else { 0.0 };
        loop {
            let Some(hit) = self.hit(&path.ray, path.scattered == 0) else {
                let found = path.density.map_or(1.0, |own| weight(own, self.lights.sky.density(path.ray.direction)));
                if path.scattered > 0 || !self.sky_unseen {
                    path.add(self.lights.sky.towards(path.ray.direction) * found);
                }
                return None;
            };
            travelled += hit.t;
            let mut vertex = self.vertex(&path.ray, hit);
            self.disperse(path, &mut vertex, sampler);
            if hit.back && self.geometry().flags[vertex.point.material].volume {
                path.throughput *= vertex.surface.params.transmittance(hit.t * self.geometry().units.size as f32);
            }
            let pass = vertex.unscattered.max_element();
            if pass > 0.0 {
                clear = false;
                if sampler.event() < pass {
                    // A blended surface is not the first surface where it passes light; thin glass is.
                    let blended = ((1.0 - vertex.surface.params.opacity) / pass).min(1.0);
                    path.sample.diffuse += remaining * (1.0 - blended) * vertex.surface.params.diffuse_share();
                    remaining *= blended;
                    path.throughput *= vertex.unscattered / pass;
                    path.ray.origin = self.offset_origin(&vertex, path.ray.direction);
                    path.ray.near = 0.0;
                    path.ray.far -= hit.t;
                    continue;
                }
                path.throughput *= vertex.surface.params.opacity / (1.0 - pass);
            }
            vertex.hit.t = travelled;
            vertex.clear = clear;
            path.sample.diffuse += remaining * vertex.surface.params.diffuse_share();
            if path.scattered == 0 {
                self.record_first_hit(path, &vertex, sampler);
            }
            return Some(vertex);
        }
    }

    /// At a surface that refracts colours by different angles, continues with one of them.
    fn disperse(&self, path: &mut Path, vertex: &mut Vertex, sampler: &mut Sampler) {
        let dispersion = vertex.surface.params.finish.map_or(0.0, |finish| finish.dispersion);
        if dispersion == 0.0 || !self.geometry().flags[vertex.point.material].volume {
            return;
        }
        let channel = *path.channel.get_or_insert_with(|| {
            let channel = ((3.0 * sampler.event()) as usize).min(2);
            path.throughput *= Vec3::AXES[channel] * 3.0;
            channel
        });
        let mut params = vertex.surface.params;
        params.ior = dispersed(params.ior, dispersion, channel);
        let wo = -path.ray.direction;
        let viewing = vertex.surface.viewed(vertex.bsdf.geometric, wo, vertex.hit.back);
        vertex.bsdf = Bsdf::new(&params, true, viewing);
    }

    /// The nearest hit that counts. For camera rays the back of a single-sided surface does not.
    fn hit(&self, ray: &Ray, camera: bool) -> Option<Hit> {
        self.bvh.nearest(ray, |hit| {
            let flags = self.flags(hit.at);
            (!camera || !hit.back || flags.double_sided || flags.volume) && self.is_opaque(flags, hit)
        })
    }

    /// Whether the alpha mask is opaque at a hit.
    #[inline]
    fn is_opaque(&self, flags: MaterialFlags, hit: &Hit) -> bool {
        !flags.masked || self.materials.opacity(hit.at) > 0.0
    }

    fn vertex(&self, ray: &Ray, hit: Hit) -> Vertex {
        let (texturing, material) = self.geometry().texturing(hit.at);
        self.materials.prefetch(&texturing, material);
        let point = self.geometry().point(hit.at, texturing);
        let mut surface = self.materials.surface(&point, hit.back);
        surface.emission *= surface.coat_leaves(-ray.direction);
        let side = if hit.back { -1.0 } else { 1.0 };
        let (geometric, wo) = (point.geometric * side, -ray.direction);
        let volume = self.geometry().flags[point.material].volume;
        let bsdf = Bsdf::new(&surface.params, volume, surface.viewed(geometric, wo, hit.back));
        let unscattered = bsdf.unscattered() * surface.params.opacity + (1.0 - surface.params.opacity);
        Vertex { hit, point, surface, bsdf, unscattered, clear: true }
    }

    /// The origin of a ray that leaves a vertex in `direction`: so far off the surface that the ray does not hit it
    /// again.
    pub(super) fn offset_origin(&self, vertex: &Vertex, direction: Vec3) -> Vec3 {
        let p = vertex.point.position;
        // A few times the spacing of f32 at the position; 16 units account for cancellation near the centre.
        let offset = 2e-6 * (p.abs().max_element() + 16.0);
        p + vertex.bsdf.geometric * offset.copysign(vertex.bsdf.geometric.dot(direction))
    }

    fn record_first_hit(&self, path: &mut Path, vertex: &Vertex, sampler: &Sampler) {
        let side = if vertex.hit.back { -1.0 } else { 1.0 };
        path.sample.first = Some(FirstHit {
            normal: vertex.surface.normal * side,
            albedo: vertex.surface.params.base_color,
            distance: vertex.hit.t,
        });
        if self.occlusion {
            let [u, v, ..] = sampler.set(OCCLUSION);
            let direction = bsdf::frame(vertex.bsdf.geometric) * bsdf::sample_cosine([u, v]);
            let open = self.transmittance(vertex, direction, None);
            path.sample.ao = open.element_sum() / 3.0;
        }
    }

    /// Adds the emission at a vertex, weighted against light sampling.
    fn add_emission(&self, path: &mut Path, vertex: &Vertex) {
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
            weight(density, self.lights.emitter_density(vertex.hit.at.triangle, vertex.hit.t, cos))
        });
        path.add(vertex.surface.emission * weight);
    }

    /// Adds the sampled lights at a vertex.
    pub(super) fn add_sampled_light(&self, path: &mut Path, vertex: &Vertex, sampler: &Sampler) {
        let k = path.scattered;
        let mut sum = Vec3::ZERO;
        for light in self.light_samples(vertex.point.position, k, sampler) {
            let (f, density) = vertex.bsdf.eval(light.direction);
            let unoccluded = f * light.weighted_radiance(density);
            if unoccluded != Vec3::ZERO {
                sum += unoccluded * self.transmittance(vertex, light.direction, light.end);
            }
        }
        let added = path.throughput * sum;
        path.sample.beauty += added;
        if k == 0 {
            path.sample.direct += added;
        }
    }

    /// The light samples at vertex `k` of a path: at most one of a punctual light, one of an emitter and one of the
    /// sky.
    pub(super) fn light_samples(&self, p: Vec3, k: u32, sampler: &Sampler) -> impl Iterator<Item = LightSample> {
        let [_, _, u, v] = sampler.set(if k == 0 { PIXEL_AND_LIGHT } else { 2 * k - 1 });
        let punctual = self.lights.punctual_at(p, || sampler.set(2 * k + 2)[2], [u, v]);
        let emitter = self.lights.emitter_at(&self.materials, p, [u, v]);
        punctual.into_iter().chain(emitter).chain(self.lights.sky.sample([u, v]))
    }

    /// The share of light that reaches a vertex from `end`, or from infinity along `direction`.
    pub(super) fn transmittance(&self, vertex: &Vertex, direction: Vec3, end: Option<Vec3>) -> Vec3 {
        let origin = self.offset_origin(vertex, direction);
        let ray = end.map_or(Ray::new(origin, direction), |end| Ray::between(origin, end));
        let mut share = Vec3::ONE;
        let blocked = self.bvh.any(&ray, |hit| {
            let flags = self.flags(hit.at);
            if flags.transparent {
                share *= self.vertex(&ray, *hit).unscattered;
                share == Vec3::ZERO
            } else {
                self.is_opaque(flags, hit)
            }
        });
        if blocked { Vec3::ZERO } else { share }
    }

    /// The bits of those of up to eight rays that hit a surface, transparent or not.
    pub(super) fn blocked(&self, rays: &[Ray]) -> u32 {
        self.bvh.any_of(rays, |hit| self.is_opaque(self.flags(hit.at), hit))
    }

    /// Samples the next ray of the path. The result is the survival probability of Russian roulette, by which the
    /// throughput has been divided; `None` if the path ends.
    pub(super) fn scatter(&self, path: &mut Path, vertex: &Vertex, sampler: &Sampler) -> Option<f32> {
        let k = path.scattered;
        if k >= self.bounces && !self.lights.can_be_hit() {
            return None;
        }
        let [u, v, _, _] = sampler.set(2 * k + 1);
        let [lobe, roulette, ..] = sampler.set(2 * k + 2);
        let scatter = vertex.bsdf.sample(lobe, [u, v])?;
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
        path.ray = Ray::new(self.offset_origin(vertex, scatter.direction), scatter.direction);
        (path.throughput != Vec3::ZERO).then_some(survive)
    }
}

impl LightSample {
    /// Radiance over density, weighted against scattering with density `scattered`.
    pub(super) fn weighted_radiance(&self, scattered: f32) -> Vec3 {
        self.radiance * self.density.map_or(1.0, |density| weight(density, scattered))
    }
}

impl Path {
    pub(super) fn new(ray: Ray) -> Self {
        let sample = Sample { ao: 1.0, ..Sample::default() };
        Self { ray, throughput: Vec3::ONE, scattered: 0, density: None, compression: 1.0, channel: None, sample }
    }

    /// Adds radiance that arrives along the path's ray.
    fn add(&mut self, radiance: Vec3) {
        let light = self.throughput * radiance;
        self.sample.beauty += light;
        if self.scattered <= 1 {
            self.sample.direct += light;
        }
    }
}

impl Surface {
    /// The vertex as `wo` sees it, from the back if `inside`; `geometric` is on that side.
    #[inline]
    fn viewed(&self, geometric: Vec3, wo: Vec3, inside: bool) -> Viewing {
        let side = if inside { -1.0 } else { 1.0 };
        let normal = bent_towards(self.normal * side, geometric, wo);
        let coat_normal = match self.params.finish {
            None => normal,
            Some(_) => bent_towards(self.coat_normal * side, geometric, wo),
        };
        Viewing { normal, coat_normal, geometric, grain: self.grain, wo, inside }
    }
}

impl Vertex {
    /// The BSDF for another viewer on the same side, in unit direction `wo`.
    #[inline]
    pub(super) fn seen_from(&self, wo: Vec3) -> Bsdf {
        if self.bsdf.is_lambertian() && self.bsdf.normal().dot(wo) > 0.0 {
            return self.bsdf.clone();
        }
        Bsdf::new(&self.surface.params, false, self.surface.viewed(self.bsdf.geometric, wo, self.hit.back))
    }
}

/// Veach's power heuristic for a strategy with density `own`, against one with density `other`.
pub(super) fn weight(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// The shading normal, bent towards the viewer if it points away.
fn bent_towards(normal: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    const LEAST: f32 = 1e-3;
    let cos = normal.dot(wo);
    if cos >= LEAST {
        return normal;
    }
    let bent = (normal + wo * (LEAST - cos)).normalize();
    if bent.dot(wo) > 0.0 { bent } else { geometric }
}
