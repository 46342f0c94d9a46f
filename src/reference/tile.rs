//! Paths of neighbouring pixels, which share their second vertices (Bekaert, Sbert and Halton 2002).
//!
//! What a surface sends towards one pixel's first vertex it sends, with another value of its BSDF, towards those of the
//! pixels around too. So after every pixel of a tile has traced its own path x → y → …, each first vertex x is joined to
//! each second vertex y that it sees. The balance heuristic over all the pixels that could have found y keeps the
//! estimate unbiased. A join costs a shadow ray and saves a path.
//!
//! Not joined: mirrors at x, and whatever lies beyond or on surfaces that light goes straight through or that bound a volume.

use glam::Vec3;

use super::bvh;
use super::integrator::{Integrator, Path, Sample, Vertex, evaluate, weight};
use super::lights::Arrival;
use super::sampler::Sampler;
use super::traversal::Ray;

/// Pixels along each side of a tile. Image quality per second (1 / noise² / time) against paths that share nothing, on a
/// Cornell box and an atrium: 2 gives 2.8 and 2.1 times as much, 3 gives 4.5 and 2.8, 4 gives 5.3 and 2.8, 6 the same.
pub const SIDE: usize = 4;

/// A pixel's first vertex.
struct Origin {
    vertex: Vertex,
    /// Of the path that arrives there.
    throughput: Vec3,
}

/// A second vertex that others may join, and the light that reaches it.
struct Joint {
    /// Of the pixel whose path found it, in the tile.
    pixel: usize,
    vertex: Vertex,
    /// Sampled lights, what stands in between taken off.
    arrivals: [Option<Arrival>; 2],
    /// What a scattered ray found.
    next: Option<Next>,
}

/// What arrives at a joint along a scattered ray.
struct Next {
    direction: Vec3,
    /// Emitted there, or by the sky; light sampling would have found it with `density`.
    emission: Vec3,
    density: f32,
    /// Everything else.
    rest: Vec3,
}

/// A first vertex that may see a joint.
struct View<'a> {
    pixel: usize,
    origin: &'a Origin,
    /// From the first vertex to the joint, unit.
    direction: Vec3,
    /// f · |cos| at the first vertex, and the density of the joint's point, both per area of the joint.
    f: Vec3,
    density: f32,
}

/// What a joint sends to one first vertex that sees it.
struct Join {
    pixel: usize,
    /// What of it the pixel gets: the path's throughput times the view's `f`.
    share: Vec3,
    density: f32,
    /// Of each sampled light, scattered to the first vertex.
    lit: [Vec3; 2],
    /// Of the joint's scattered ray: f · |cos| and density per steradian.
    next: (Vec3, f32),
}

impl Integrator<'_> {
    /// One sample for each pixel of a tile: of `rays[i]`, with the numbers of `samplers[i]`.
    pub fn trace(&self, rays: &[Ray], samplers: &mut [Sampler]) -> Vec<Sample> {
        let mut samples = Vec::with_capacity(rays.len());
        let mut origins = Vec::with_capacity(rays.len());
        let mut joints = Vec::new();
        for (pixel, (ray, sampler)) in rays.iter().zip(samplers).enumerate() {
            let mut path = Path::new(*ray);
            origins.push(self.first(&mut path, sampler, &mut joints, pixel));
            samples.push(path.sample);
        }
        for joint in &joints {
            self.join(joint, &origins, &mut samples);
        }
        samples
    }

    /// Traces one path up to where others may join it, or to its end if they may not.
    fn first(&self, path: &mut Path, sampler: &mut Sampler, joints: &mut Vec<Joint>, pixel: usize) -> Option<Origin> {
        let vertex = self.advance(path, sampler)?;
        self.emitted(path, &vertex);
        if !self.continues(path, &vertex) {
            return None;
        }
        self.lit(path, &vertex, sampler);
        let origin = Origin { throughput: path.throughput, vertex };
        if self.scatter(path, &origin.vertex, sampler).is_some() {
            self.second(path, sampler, joints, pixel);
        }
        Some(origin)
    }

    fn second(&self, path: &mut Path, sampler: &mut Sampler, joints: &mut Vec<Joint>, pixel: usize) {
        let Some(vertex) = self.advance(path, sampler) else { return };
        self.emitted(path, &vertex);
        if !self.continues(path, &vertex) {
            return;
        }
        let shared = path.density.is_some() && vertex.clear && !self.geometry.traits[vertex.point.material].volume;
        if !shared {
            self.lit(path, &vertex, sampler);
            if self.scatter(path, &vertex, sampler).is_some() {
                self.follow(path, sampler);
            }
            return;
        }
        let arrivals = self.reaching(&vertex, sampler);
        let next = self.scattered(path, &vertex, sampler);
        joints.push(Joint { pixel, vertex, arrivals, next });
    }

    /// Sampled lights at a joint that are not hidden.
    fn reaching(&self, vertex: &Vertex, sampler: &Sampler) -> [Option<Arrival>; 2] {
        let mut reaching = [None; 2];
        for (slot, arrival) in reaching.iter_mut().zip(self.arrivals(vertex.point.position, 1, sampler)) {
            if vertex.geometric.dot(arrival.direction) > 0.0 || vertex.bsdf.transmits() {
                let share = self.transmittance(vertex, arrival.direction, arrival.end);
                *slot = (share != Vec3::ZERO).then(|| Arrival { radiance: arrival.radiance * share, ..arrival });
            }
        }
        reaching
    }

    /// Light along a ray scattered at a joint. A mirror's goes to the path's own pixel alone.
    fn scattered(&self, path: &mut Path, vertex: &Vertex, sampler: &mut Sampler) -> Option<Next> {
        let throughput = std::mem::replace(&mut path.throughput, Vec3::ONE);
        let survive = self.scatter(path, vertex, sampler)?;
        if path.density.is_none() {
            path.throughput *= throughput;
            self.follow(path, sampler);
            return None;
        }
        // The joins bring the joint's own f / density; only roulette's share is the path's.
        let mut tail = Path { throughput: Vec3::splat(1.0 / survive), ..Path::new(path.ray) };
        tail.scattered = path.scattered;
        let direction = tail.ray.direction;
        let Some(next) = self.advance(&mut tail, sampler) else {
            return Some(Next { direction, emission: tail.sample.beauty, density: 0.0, rest: Vec3::ZERO });
        };
        let emission = tail.throughput * next.surface.emission;
        let cos = next.point.geometric.dot(direction);
        let density = self.lights.emitter_density(next.hit.triangle, next.hit.t, cos);
        if self.continues(&tail, &next) {
            self.lit(&mut tail, &next, sampler);
            if self.scatter(&mut tail, &next, sampler).is_some() {
                self.follow(&mut tail, sampler);
            }
        }
        Some(Next { direction, emission, density, rest: tail.sample.beauty })
    }

    /// Gives every first vertex that sees the joint its share.
    fn join(&self, joint: &Joint, origins: &[Option<Origin>], samples: &mut [Sample]) {
        let mut joins = Vec::with_capacity(origins.len());
        let (mut density, mut next_density) = (0.0, 0.0);
        for view in self.views(joint, origins) {
            let join = view.join(joint);
            density += join.density;
            next_density += join.density * join.next.1;
            joins.push(join);
        }
        for join in &joins {
            let mut light = Vec3::ZERO;
            for lit in join.lit {
                light += lit / density;
            }
            if let Some(next) = joint.next.as_ref().filter(|_| join.next.1 > 0.0) {
                let arriving = next.emission * weight(join.next.1, next.density) + next.rest;
                light += join.next.0 * arriving / next_density;
            }
            samples[join.pixel].beauty += join.share * light;
        }
    }

    /// The first vertices that see the joint.
    fn views<'a>(&self, joint: &Joint, origins: &'a [Option<Origin>]) -> impl Iterator<Item = View<'a>> {
        let mut views = Vec::with_capacity(origins.len());
        for (pixel, origin) in origins.iter().enumerate() {
            views.extend(origin.as_ref().and_then(|origin| View::new(joint, origin, pixel)));
        }
        // The joint's own pixel found it: nothing stands between.
        let (mut others, mut rays, mut count) = ([0; SIDE * SIDE], [Ray::default(); SIDE * SIDE], 0);
        for (i, view) in views.iter().enumerate().filter(|(_, view)| view.pixel != joint.pixel) {
            (others[count], rays[count]) = (i, self.between(&view.origin.vertex, &joint.vertex, view.direction));
            count += 1;
        }
        let mut hidden = [false; SIDE * SIDE];
        for (others, rays) in others[..count].chunks(bvh::WIDTH).zip(rays[..count].chunks(bvh::WIDTH)) {
            let blocked = self.blocked(rays);
            others.iter().enumerate().for_each(|(bit, &i)| hidden[i] = blocked >> bit & 1 == 1);
        }
        views.into_iter().zip(hidden).filter_map(|(view, hidden)| (!hidden).then_some(view))
    }
}

impl<'a> View<'a> {
    /// A first vertex as the joint sees it if nothing stands between; `None` if it turns away.
    fn new(joint: &Joint, origin: &'a Origin, pixel: usize) -> Option<Self> {
        let to = joint.vertex.point.position - origin.vertex.point.position;
        let distance2 = to.length_squared();
        let direction = to / distance2.sqrt();
        let cos = -joint.vertex.geometric.dot(direction);
        if !(cos > 0.0 && distance2 > 0.0) {
            return None;
        }
        let (f, density) = origin.vertex.evaluate(direction);
        let per_area = cos / distance2;
        (density > 0.0).then(|| Self { pixel, origin, direction, f: f * per_area, density: density * per_area })
    }

    fn join(self, joint: &Joint) -> Join {
        let bsdf = joint.vertex.seen_from(-self.direction);
        let evaluate = |direction| evaluate(&bsdf, joint.vertex.geometric, direction);
        let lit = joint.arrivals.map(|arrival| {
            arrival.map_or(Vec3::ZERO, |arrival| {
                let (f, scattered) = evaluate(arrival.direction);
                f * arrival.weighted(scattered)
            })
        });
        let next = joint.next.as_ref().map_or((Vec3::ZERO, 0.0), |next| evaluate(next.direction));
        Join { pixel: self.pixel, share: self.origin.throughput * self.f, density: self.density, lit, next }
    }
}
