//! Paths of neighbouring pixels that reuse each other's second vertices (Bekaert, Sbert and Halton 2002).
//!
//! Every pixel of a tile traces its own path x → y → …. Then each first vertex x is connected to each visible second
//! vertex y: the radiance that y sends to another x differs only by the BSDF at y. The balance heuristic over all
//! pixels that could have sampled y keeps the estimate unbiased. A connection costs a shadow ray and replaces a path.
//!
//! Mirrors at x, surfaces that pass light unscattered, everything behind those, and surfaces of volumes are not
//! connected.

use glam::Vec3;
use rayon::prelude::*;

use super::bvh;
use super::film::PixelRow;
use super::integrator::{Integrator, Path, Sample, Vertex, weight};
use super::lights::LightSample;
use super::sampler::Sampler;
use super::traversal::Ray;

/// Pixels along each side of a tile. Efficiency (1 / noise² / time) relative to independent paths, for a Cornell box
/// and an atrium: side 2 gives 2.8 and 2.1, side 3 4.5 and 2.8, side 4 5.3 and 2.8, side 6 the same as 4.
const SIDE: usize = 4;

/// The tiles of consecutive samples. They change, because pixels of a tile share their noise, and fixed tiles would be
/// visible.
///
/// There are four changes in each doubling of the number of samples: samples of one pixel are stratified, and stay so
/// in each quarter. Compared with fixed tiles at 64 to 256 samples, steps of noise across fixed borders are 0.98 to
/// 1.01 of those within tiles (1.14 to 2.22 before). A sample costs the same, and the noise is 1 % higher in the
/// gallery, 3 % in an atrium, 6 % on stairs, and 6 to 10 % in a Cornell box. Changes after every second sample cost up
/// to 9 % more noise, and two in each doubling no less than four.
pub struct Tiles {
    /// The width of the first column of tiles, and the height of the first row: 1 to [`SIDE`] pixels.
    first: [usize; 2],
    /// The number of the first sample with other tiles.
    pub end: u32,
}

impl Tiles {
    /// The tiles of sample number `index`.
    pub fn from_tile(index: u32) -> Self {
        let samples = (1 << index.max(16).ilog2()) / 4;
        let change = (index / samples) as usize;
        // Four changes put borders at each position in each direction.
        let x = [0, 2, 1, 3][change % SIDE];
        let y = ([0, 2, 3, 1][change % SIDE] + change / SIDE) % SIDE;
        Self { first: [SIDE - x, SIDE - y], end: index - index % samples + samples }
    }

    /// The left edges and widths of the columns of tiles across an image of `width` pixels.
    pub fn columns(&self, width: usize) -> impl Iterator<Item = (usize, usize)> {
        let first = self.first[0].min(width);
        let next = (first..width).step_by(SIDE).map(move |left| (left, SIDE.min(width - left)));
        std::iter::once((0, first)).chain(next)
    }

    /// The rows of tiles, each with the number of its first row of pixels.
    pub fn rows<'a>(
        &self,
        rows: &'a mut [PixelRow],
    ) -> impl IndexedParallelIterator<Item = (usize, &'a mut [PixelRow])> {
        let first = self.first[1].min(rows.len());
        let (above, below) = rows.split_at_mut(first);
        let next = below.par_chunks_mut(SIDE).enumerate().map(move |(i, rows)| (first + i * SIDE, rows));
        rayon::iter::once((0, above)).chain(next)
    }

    /// Whether all rows of each row of tiles have the same number of samples.
    pub fn are_even(&self, rows: &[PixelRow]) -> bool {
        let (above, below) = rows.split_at(self.first[1].min(rows.len()));
        let same = |rows: &[PixelRow]| rows.iter().all(|row| row.done == rows[0].done);
        same(above) && below.chunks(SIDE).all(same)
    }
}

/// Samples of a punctual light, of an emitter, and of the sky.
const LIGHT_SAMPLES: usize = 3;

/// A pixel's first vertex.
struct FirstVertex {
    vertex: Vertex,
    /// Throughput of the path up to this vertex.
    throughput: Vec3,
}

/// A second vertex that all pixels of the tile may use, and the light that reaches it.
struct SharedVertex {
    /// The pixel of the path that found it, as an index in the tile.
    pixel: usize,
    vertex: Vertex,
    /// The sampled lights; their radiance includes occlusion.
    lights: [Option<LightSample>; LIGHT_SAMPLES],
    scattered: Option<ScatteredLight>,
}

/// The light that reaches a shared vertex along its scattered ray.
struct ScatteredLight {
    direction: Vec3,
    /// Radiance emitted by the next surface or by the sky; light sampling would have found it with `density`.
    emission: Vec3,
    density: f32,
    /// The radiance of all other light.
    rest: Vec3,
}

/// A first vertex and a shared vertex that face each other.
struct Connection<'a> {
    pixel: usize,
    first: &'a FirstVertex,
    /// From the first vertex to the shared one, unit.
    direction: Vec3,
    /// f · |cos| at the first vertex, and the density of its sampling the shared vertex; both per area of the shared
    /// vertex.
    f: Vec3,
    density: f32,
}

/// The light that a shared vertex sends along a connection.
struct Contribution {
    pixel: usize,
    /// Throughput of the path up to the first vertex, times the connection's `f`.
    throughput: Vec3,
    density: f32,
    /// Radiance of each sampled light, scattered towards the first vertex.
    lights: [Vec3; LIGHT_SAMPLES],
    /// For the scattered ray: f · |cos|, and the density per steradian.
    scattered: (Vec3, f32),
}

impl Integrator<'_> {
    /// One sample for each pixel of a tile, from `rays[i]` and the random numbers `samplers[i]`.
    pub fn trace(&self, rays: &[Ray], samplers: &mut [Sampler]) -> Vec<Sample> {
        let mut samples = Vec::with_capacity(rays.len());
        let mut firsts = Vec::with_capacity(rays.len());
        let mut shared = Vec::new();
        for (pixel, (ray, sampler)) in rays.iter().zip(samplers).enumerate() {
            let mut path = Path::new(*ray);
            let first = self.arrive(&mut path, sampler).map(|vertex| {
                self.add_sampled_light(&mut path, &vertex, sampler);
                FirstVertex { throughput: path.throughput, vertex }
            });
            if first.as_ref().is_some_and(|first| self.scatter(&mut path, &first.vertex, sampler).is_some()) {
                shared.extend(self.trace_second(&mut path, sampler, pixel));
            }
            firsts.push(first);
            samples.push(path.sample);
        }
        for vertex in &shared {
            self.distribute(vertex, &firsts, &mut samples);
        }
        samples
    }

    /// Traces a path to its second vertex. If that cannot be shared, the path is traced to its end.
    fn trace_second(&self, path: &mut Path, sampler: &mut Sampler, pixel: usize) -> Option<SharedVertex> {
        let vertex = self.arrive(path, sampler)?;
        let shared = path.density.is_some() && vertex.clear && !self.geometry().flags[vertex.point.material].volume;
        if !shared {
            self.follow_from(&vertex, path, sampler);
            return None;
        }
        let lights = self.visible_lights(&vertex, sampler);
        let scattered = self.scattered_light(path, &vertex, sampler);
        Some(SharedVertex { pixel, vertex, lights, scattered })
    }

    /// The unoccluded light samples at a shared vertex.
    fn visible_lights(&self, vertex: &Vertex, sampler: &Sampler) -> [Option<LightSample>; LIGHT_SAMPLES] {
        let mut visible = [None; LIGHT_SAMPLES];
        for (slot, light) in visible.iter_mut().zip(self.light_samples(vertex.point.position, 1, sampler)) {
            if vertex.bsdf.geometric.dot(light.direction) > 0.0 || vertex.bsdf.transmits() {
                let share = self.transmittance(vertex, light.direction, light.end);
                *slot = (share != Vec3::ZERO).then(|| LightSample { radiance: light.radiance * share, ..light });
            }
        }
        visible
    }

    /// The light along the scattered ray of a shared vertex. For a mirror it is added to the path's own pixel instead.
    fn scattered_light(&self, path: &mut Path, vertex: &Vertex, sampler: &mut Sampler) -> Option<ScatteredLight> {
        let throughput = std::mem::replace(&mut path.throughput, Vec3::ONE);
        let survive = self.scatter(path, vertex, sampler)?;
        if path.density.is_none() {
            path.throughput *= throughput;
            self.follow(path, sampler);
            return None;
        }
        // Connections multiply by f / density at the shared vertex, so the tail only carries the factor of roulette.
        let mut tail = Path { throughput: Vec3::splat(1.0 / survive), ..Path::new(path.ray) };
        tail.scattered = path.scattered;
        let direction = tail.ray.direction;
        let Some(next) = self.advance(&mut tail, sampler) else {
            let (emission, density) = (tail.sample.beauty, self.lights.sky.density(direction));
            return Some(ScatteredLight { direction, emission, density, rest: Vec3::ZERO });
        };
        let emission = tail.throughput * next.surface.emission;
        let cos = next.point.geometric.dot(direction);
        let density = self.lights.emitter_density(next.hit.at.triangle, next.hit.t, cos);
        if self.continues(&tail, &next) {
            self.follow_from(&next, &mut tail, sampler);
        }
        Some(ScatteredLight { direction, emission, density, rest: tail.sample.beauty })
    }

    /// Adds the light of a shared vertex to all pixels whose first vertex sees it.
    fn distribute(&self, shared: &SharedVertex, firsts: &[Option<FirstVertex>], samples: &mut [Sample]) {
        let mut contributions = Vec::with_capacity(firsts.len());
        let (mut density, mut scattered_density) = (0.0, 0.0);
        for connection in self.connections(shared, firsts) {
            let contribution = connection.contribution(shared);
            density += contribution.density;
            scattered_density += contribution.density * contribution.scattered.1;
            contributions.push(contribution);
        }
        for contribution in &contributions {
            let mut radiance = Vec3::ZERO;
            for light in contribution.lights {
                radiance += light / density;
            }
            let (f, own_density) = contribution.scattered;
            if let Some(scattered) = shared.scattered.as_ref().filter(|_| own_density > 0.0) {
                let arriving = scattered.emission * weight(own_density, scattered.density) + scattered.rest;
                radiance += f * arriving / scattered_density;
            }
            samples[contribution.pixel].beauty += contribution.throughput * radiance;
        }
    }

    /// The unoccluded connections of a shared vertex.
    fn connections<'a>(
        &self,
        shared: &SharedVertex,
        firsts: &'a [Option<FirstVertex>],
    ) -> impl Iterator<Item = Connection<'a>> {
        let mut connections = Vec::with_capacity(firsts.len());
        for (pixel, first) in firsts.iter().enumerate() {
            connections.extend(first.as_ref().and_then(|first| Connection::new(shared, first, pixel)));
        }
        // The own pixel's path has found the vertex, so this connection is unoccluded.
        let (mut others, mut rays, mut count) = ([0; SIDE * SIDE], [Ray::default(); SIDE * SIDE], 0);
        for (i, connection) in connections.iter().enumerate().filter(|(_, c)| c.pixel != shared.pixel) {
            let from = self.offset_origin(&connection.first.vertex, connection.direction);
            let ray = Ray::between(from, self.offset_origin(&shared.vertex, -connection.direction));
            (others[count], rays[count]) = (i, ray);
            count += 1;
        }
        let mut occluded = [false; SIDE * SIDE];
        for (others, rays) in others[..count].chunks(bvh::WIDTH).zip(rays[..count].chunks(bvh::WIDTH)) {
            let blocked = self.blocked(rays);
            others.iter().enumerate().for_each(|(bit, &i)| occluded[i] = blocked >> bit & 1 == 1);
        }
        connections.into_iter().zip(occluded).filter_map(|(connection, occluded)| (!occluded).then_some(connection))
    }
}

impl<'a> Connection<'a> {
    /// `None` if one of the vertices faces away from the other.
    fn new(shared: &SharedVertex, first: &'a FirstVertex, pixel: usize) -> Option<Self> {
        let to = shared.vertex.point.position - first.vertex.point.position;
        let distance2 = to.length_squared();
        let direction = to / distance2.sqrt();
        let cos = -shared.vertex.bsdf.geometric.dot(direction);
        if !(cos > 0.0 && distance2 > 0.0) {
            return None;
        }
        let (f, density) = first.vertex.bsdf.eval(direction);
        let per_area = cos / distance2;
        (density > 0.0).then(|| Self { pixel, first, direction, f: f * per_area, density: density * per_area })
    }

    fn contribution(self, shared: &SharedVertex) -> Contribution {
        let bsdf = shared.vertex.seen_from(-self.direction);
        let lights = shared.lights.map(|light| {
            light.map_or(Vec3::ZERO, |light| {
                let (f, scattered) = bsdf.eval(light.direction);
                f * light.weighted_radiance(scattered)
            })
        });
        let scattered = shared.scattered.as_ref().map_or((Vec3::ZERO, 0.0), |light| bsdf.eval(light.direction));
        let throughput = self.first.throughput * self.f;
        Contribution { pixel: self.pixel, throughput, density: self.density, lights, scattered }
    }
}
