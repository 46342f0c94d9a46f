//! Twin of the passes of `glsl/gi/probes/`, in f64, written from the formulas of the two papers that the method
//! follows.

use glam::{DVec2, DVec3, DVec4, IVec2, IVec3};

/// Texels along each side of a map of light.
pub const LIGHT_SIDE: i32 = 8;
/// Texels along each side of a map of distances.
pub const DISTANCE_SIDE: i32 = 16;

fn sign(v: f64) -> f64 {
    if v < 0.0 { -1.0 } else { 1.0 }
}

/// The direction of a place on the octahedral map, in −1…1. Beyond an edge the map continues at the same edge, mirrored
/// about the edge's middle.
pub fn way_at(place: DVec2) -> DVec3 {
    let mut at = place;
    if at.x.abs() > 1.0 {
        at = DVec2::new(sign(at.x) * 2.0 - at.x, -at.y);
    }
    if at.y.abs() > 1.0 {
        at = DVec2::new(-at.x, sign(at.y) * 2.0 - at.y);
    }
    let z = 1.0 - at.x.abs() - at.y.abs();
    let p = if z < 0.0 {
        DVec3::new((1.0 - at.y.abs()) * sign(at.x), (1.0 - at.x.abs()) * sign(at.y), z)
    } else {
        DVec3::new(at.x, at.y, z)
    };
    p.normalize()
}

/// The place of a direction on the octahedral map, in −1…1.
pub fn place_of(d: DVec3) -> DVec2 {
    let p = d / (d.x.abs() + d.y.abs() + d.z.abs());
    if p.z < 0.0 { DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)) } else { p.truncate() }
}

/// The direction of a texel's middle. The coordinates −1 and `side` are the border.
pub fn texel_way(texel: IVec2, side: i32) -> DVec3 {
    way_at((texel.as_dvec2() + 0.5) * (2.0 / f64::from(side)) - 1.0)
}

/// The index of a texel in a map with its border.
pub fn texel_index(texel: IVec2, side: i32) -> usize {
    ((texel.y + 1) * (side + 2) + texel.x + 1) as usize
}

/// All texels of a map with its border; `of` gives the texel of a direction.
pub fn map<T>(side: i32, of: impl Fn(DVec3) -> T) -> Vec<T> {
    let texels = (-1..=side).flat_map(|y| (-1..=side).map(move |x| IVec2::new(x, y)));
    texels.map(|texel| of(texel_way(texel, side))).collect()
}

/// The result of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub way: DVec3,
    pub light: DVec3,
    pub open: f64,
    /// Distance in voxels; negative for the back of a surface.
    pub distance: f64,
}

/// A texel of light: the mean of the rays' light, weighted by the cosine to `n`.
pub fn light(rays: &[Ray], n: DVec3) -> DVec4 {
    let mean = |sum: (DVec4, f64), ray: &Ray| {
        let weight = n.dot(ray.way).max(0.0);
        (sum.0 + weight * ray.light.extend(ray.open), sum.1 + weight)
    };
    let (sum, total) = rays.iter().fold((DVec4::ZERO, 0.0), mean);
    sum / total
}

/// A texel of distances: mean and mean square, weighted by the cosine's fiftieth power. `most` is the upper limit of
/// distances.
pub fn distances(rays: &[Ray], n: DVec3, most: f64) -> DVec2 {
    let mean = |sum: (DVec2, f64), ray: &Ray| {
        let weight = n.dot(ray.way).max(0.0).powi(50);
        let met = if ray.distance < 0.0 { -0.2 * ray.distance } else { ray.distance };
        let met = met.min(most);
        (sum.0 + weight * DVec2::new(met, met * met), sum.1 + weight)
    };
    let (sum, total) = rays.iter().fold((DVec2::ZERO, 0.0), mean);
    sum / total
}

/// Bilinear filtering of the four texels about a direction.
pub fn read<T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>>(map: &[T], side: i32, d: DVec3) -> T {
    let at = (place_of(d) * 0.5 + 0.5) * f64::from(side) - 0.5;
    let least = at.floor();
    let part = at - least;
    let texel = |x: i32, y: i32| map[texel_index(least.as_ivec2() + IVec2::new(x, y), side)];
    let row = |y: i32| texel(0, y) * (1.0 - part.x) + texel(1, y) * part.x;
    row(0) * (1.0 - part.y) + row(1) * part.y
}

/// The weight of a probe by the cosines between its direction and the normal, and the facet normal. `behind`: as in the
/// papers.
pub fn facing_weight(cosine: f64, facet_cosine: f64, behind: bool) -> f64 {
    let wrapped = ((cosine + 1.0) / 2.0).powi(2);
    if behind {
        wrapped + 0.2
    } else if facet_cosine > 0.0 {
        wrapped
    } else {
        0.0
    }
}

/// Chebyshev's upper bound on the visibility of a point at a distance, cubed.
pub fn seen_weight(moments: DVec2, distance: f64) -> f64 {
    let variance = (moments.y - moments.x * moments.x).abs();
    if distance <= moments.x { 1.0 } else { (variance / (variance + (distance - moments.x).powi(2))).powi(3) }
}

pub fn crushed(weight: f64) -> f64 {
    if weight < 0.2 { weight.powi(3) / 0.04 } else { weight }
}

/// A grid of probes.
#[derive(Clone, Debug)]
pub struct Grid {
    pub edge: i32,
    pub corner: DVec3,
    pub spacing: f64,
    pub first: IVec3,
    /// All probes, z-major by the cell modulo the edge.
    pub probes: Vec<Probe>,
}

#[derive(Clone, Debug)]
pub struct Probe {
    pub position: DVec3,
    pub active: bool,
    pub light: Vec<DVec4>,
    pub distances: Vec<DVec2>,
}

impl Grid {
    pub fn index(&self, cell: IVec3) -> usize {
        let slot = cell.rem_euclid(IVec3::splat(self.edge));
        ((slot.z * self.edge + slot.y) * self.edge + slot.x) as usize
    }
}

/// A surface point at which the probes are read.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub position: DVec3,
    pub normal: DVec3,
    pub facet: DVec3,
    pub view: DVec3,
}

/// The light of the probes at a point. `bias` is the self-shadow bias.
pub fn look_up(grid: &Grid, p: &Point, bias: f64, behind: bool) -> Option<DVec4> {
    let at = (p.position - grid.corner) / grid.spacing - 0.5;
    let base = at.floor().as_ivec3().clamp(IVec3::ZERO, IVec3::splat(grid.edge - 2));
    let part = (at - base.as_dvec3()).clamp(DVec3::ZERO, DVec3::ONE);
    let view = if p.view.dot(p.facet) > 0.0 { p.view } else { p.facet };
    let seen_from = p.position + (0.2 * p.facet + 0.8 * view) * (0.75 * grid.spacing * bias);
    let (mut sum, mut total) = (DVec4::ZERO, 0.0);
    for k in 0..8 {
        let step = IVec3::new(k & 1, k >> 1 & 1, k >> 2);
        let probe = &grid.probes[grid.index(grid.first + base + step)];
        if !probe.active {
            continue;
        }
        let near: f64 = (0..3).map(|a| if step[a] == 1 { part[a] } else { 1.0 - part[a] }.max(1e-3)).product();
        let to = (probe.position - p.position).normalize();
        let facing = facing_weight(to.dot(p.normal), to.dot(p.facet), behind);
        let from = seen_from - probe.position;
        let seen = seen_weight(read(&probe.distances, DISTANCE_SIDE, from), from.length());
        let weight = crushed(facing * seen) * near;
        sum += weight * read(&probe.light, LIGHT_SIDE, p.normal);
        total += weight;
    }
    (total > 0.0).then(|| sum / total)
}

/// The final position of a probe that starts at the middle of its cell. `felt` gives the rays of a position: pairs of a
/// direction and a distance, negative for back faces.
pub fn moved(middle: DVec3, spacing: f64, rounds: u32, felt: impl Fn(DVec3) -> Vec<(DVec3, f64)>) -> DVec3 {
    let mut position = middle;
    for _ in 0..rounds {
        let rays = felt(position);
        let clearance = 0.2 * spacing;
        let nearest = |back: bool| {
            let of_kind = rays.iter().filter(|ray| (ray.1 < 0.0) == back);
            of_kind.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        };
        let backs = rays.iter().filter(|ray| ray.1 < 0.0).count();
        let step = match (nearest(true), nearest(false)) {
            (Some((way, distance)), _) if 10 * backs > rays.len() => *way * (distance.abs() + 0.5 * clearance),
            (_, Some((way, distance))) if *distance < clearance => {
                let opposite = rays.iter().filter(|ray| ray.0.dot(*way) < -0.8);
                let behind = opposite.map(|ray| ray.1.abs()).fold(1e30, f64::min);
                -*way * (clearance.min(0.5 * (distance + behind)) - distance).max(0.0)
            }
            _ => DVec3::ZERO,
        };
        let most = DVec3::splat(0.45 * spacing);
        position = middle + (position + step - middle).clamp(-most, most);
    }
    position
}
