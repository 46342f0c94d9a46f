//! Emissive triangles as area lights (`lights.lamps = sampled`): pieces of constant radiance, and a tree of neighbours
//! to choose among many. `glsl/ground/lamps.glsl` samples them.

use std::borrow::Cow;
use std::collections::HashMap;

use bytemuck::Zeroable;
use glam::{DAffine3, DVec3, Vec2, Vec3};

use super::grid::Grid;
use super::layout;
use crate::scene::surface::SurfacePoint;
use crate::scene::texture::{ColorSpace, Sampling, Textures};
use crate::scene::{Mesh, Pose, Scene};

/// Textured triangles are split into 4ᵏ pieces, each with the mean radiance of its texels; the maximum of k.
const MOST_CUTS: u32 = 3;
/// The maximum number of pieces made by splitting. A scene with more lamp triangles has more.
const MOST_PIECES: usize = 1 << 16;
/// Points along each side of a piece at which its emission is evaluated.
const GRID: u32 = 4;
/// Pieces that differ by less than this share of the brightest one become one.
const EVEN: f32 = 0.01;

/// A triangle in object space with constant radiance.
#[derive(Clone, Copy, Debug)]
struct Piece {
    instance: usize,
    corners: [Vec3; 3],
    radiance: Vec3,
    /// See [`layout::Lamp`].
    shine: f32,
    two_sided: bool,
    /// For a mesh that deforms: the vertices of the triangle that contains the piece, and their weights at the piece's
    /// corners.
    of: Option<([u32; 3], [Vec3; 3])>,
}

/// The lamps of a scene, which are made once; a pose places them.
#[derive(Clone, Debug, Default)]
pub struct Lamps {
    pieces: Vec<Piece>,
}

impl Lamps {
    pub fn new(scene: &Scene) -> Self {
        let material = |instance: usize| &scene.materials[scene.meshes[scene.instances[instance].mesh].material];
        let lamps: Vec<usize> =
            (0..scene.instances.len()).filter(|&i| material(i).emissive != Vec3::ZERO && !material(i).unlit).collect();
        let textures = Textures::of_materials(scene, lamps.iter().map(|&i| material(i)));
        let triangles: usize = lamps.iter().map(|&i| scene.meshes[scene.instances[i].mesh].indices.len() / 3).sum();
        let cuts = (0..=MOST_CUTS).rev().find(|&k| triangles << (2 * k) <= MOST_PIECES).unwrap_or(0);
        let mut pieces = Vec::new();
        for instance in lamps {
            let mesh = &scene.meshes[scene.instances[instance].mesh];
            for triangle in mesh.indices.chunks_exact(3) {
                let lamp = Lamp { scene, textures: &textures, mesh, triangle };
                let vertices = [triangle[0], triangle[1], triangle[2]];
                pieces.extend(lamp.pieces(cuts).map(|(corners, radiance)| Piece {
                    instance,
                    of: mesh.deform.is_some().then_some((vertices, corners)),
                    corners: corners.map(|w| lamp.position(w)),
                    radiance,
                    shine: scene.materials[mesh.material].emissive.max_element(),
                    two_sided: scene.materials[mesh.material].double_sided,
                }));
            }
        }
        Self { pieces }
    }

    /// The maximum number of pieces from [`Self::place`] for `samples` points per lit place.
    pub fn count(&self, samples: u32) -> u32 {
        if self.pieces.is_empty() { 0 } else { (self.pieces.len() as u32).max(samples) }
    }

    /// The pieces that the GPU samples. Fewer lamps than samples are split until every sample has its own piece. More
    /// pieces are chosen through a tree, in which neighbours are adjacent.
    pub fn place(&self, scene: &Scene, pose: &Pose, grid: &Grid, samples: u32) -> PlacedLamps {
        let voxel_from_world = grid.voxel_from_world();
        let frames: Vec<DAffine3> = pose.world_from_instance.iter().map(|w| voxel_from_world * *w).collect();
        let mut posed: HashMap<usize, Cow<[Vec3]>> = HashMap::new();
        let mut piece = |piece: &Piece| {
            let Some((vertices, weights)) = piece.of else { return *piece };
            let mesh = scene.instances[piece.instance].mesh;
            let positions = posed.entry(mesh).or_insert_with(|| scene.meshes[mesh].posed_positions(pose));
            let [a, b, c] = vertices.map(|vertex| positions[vertex as usize]);
            Piece { corners: weights.map(|w| a * w.x + b * w.y + c * w.z), ..*piece }
        };
        let mut placed: Vec<Placed> = self.pieces.iter().map(|p| Placed::new(&piece(p), &frames[p.instance])).collect();
        placed.retain(|p| p.power() > 0.0);
        if placed.is_empty() {
            return PlacedLamps::default();
        }
        let many = placed.len() > samples as usize;
        while placed.len() < samples as usize {
            let powers = placed.iter().map(Placed::power);
            let (strongest, _) = powers.enumerate().fold((0, -1.0), |a, b| if b.1 > a.1 { b } else { a });
            let halves = placed.swap_remove(strongest).halves();
            placed.extend(halves);
        }
        let placed = in_halves(&placed);
        let pieces = placed.iter().map(Placed::record).collect();
        PlacedLamps { pieces, nodes: if many { tree(&placed) } else { Vec::new() } }
    }
}

/// Lamp pieces that the GPU samples, and the tree over them.
#[derive(Clone, Debug, Default)]
pub struct PlacedLamps {
    pub pieces: Vec<layout::Lamp>,
    /// The root is at index 1, and the halves of node n are at 2n and 2n + 1; a node of one piece has none. Empty for
    /// few pieces.
    pub nodes: Vec<layout::LampNode>,
}

/// Totals of the placed lamps, which every shader of a frame uses.
#[derive(Clone, Copy, Debug, Default)]
pub struct LampSums {
    pub count: u32,
    /// Whether pieces are chosen through the tree.
    pub tree: bool,
    /// See `lamp_shine` of `glsl/ground/layout.glsl`.
    pub shine: f32,
}

impl PlacedLamps {
    pub fn sums(&self) -> LampSums {
        let shine = |lamp: &layout::Lamp| {
            let [a, b, c] = [lamp.a, lamp.b, lamp.c].map(Vec3::from_array);
            (b - a).cross(c - a).length() / 2.0 * lamp.shine
        };
        let shine = self.pieces.iter().map(shine).sum();
        LampSums { count: self.pieces.len() as u32, tree: !self.nodes.is_empty(), shine }
    }
}

/// The number of nodes of a tree over `pieces`.
pub fn node_count(pieces: u32) -> u32 {
    2 * pieces.next_power_of_two()
}

/// The pieces ordered so that neighbours are adjacent: a plane across the longest axis separates the halves.
fn in_halves(placed: &[Placed]) -> Vec<Placed> {
    let mut order: Vec<(DVec3, usize)> = placed.iter().map(Placed::middle).zip(0..).collect();
    halve(&mut order);
    order.into_iter().map(|(_, index)| placed[index]).collect()
}

fn halve(part: &mut [(DVec3, usize)]) {
    if part.len() < 2 {
        return;
    }
    let bound = |pick: fn(DVec3, DVec3) -> DVec3| part.iter().map(|p| p.0).reduce(pick).expect("two pieces");
    let axis = (bound(DVec3::max) - bound(DVec3::min)).max_position();
    part.sort_by(|p, q| p.0[axis].total_cmp(&q.0[axis]));
    let (low, high) = part.split_at_mut(part.len() / 2);
    halve(low);
    halve(high);
}

/// The tree over pieces in the order of [`in_halves`].
fn tree(placed: &[Placed]) -> Vec<layout::LampNode> {
    let mut nodes = vec![layout::LampNode::zeroed(); node_count(placed.len() as u32) as usize];
    let mut open = vec![(1, placed)];
    while let Some((place, part)) = open.pop() {
        nodes[place] = node(part);
        if part.len() > 1 {
            let (low, high) = part.split_at(part.len() / 2);
            open.extend([(2 * place, low), (2 * place + 1, high)]);
        }
    }
    nodes
}

/// The sphere around all pieces, centred in their bounds, and the cone around their mean normal.
fn node(part: &[Placed]) -> layout::LampNode {
    let corners = || part.iter().flat_map(|p| p.corners);
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let center = ((low + high) / 2.0).as_vec3();
    let radius = corners().map(|c| c.distance(center.as_dvec3())).fold(0.0, f64::max);
    let axis = part.iter().map(|p| p.normal() * p.power()).sum::<DVec3>().normalize_or(DVec3::Y);
    let cosine = |p: &Placed| if p.two_sided { -1.0 } else { p.normal().dot(axis).clamp(-1.0, 1.0) };
    layout::LampNode {
        axis: axis.as_vec3().to_array(),
        spread_cosine: part.iter().map(cosine).fold(1.0, f64::min) as f32,
        center: center.to_array(),
        radius: (radius * (1.0 + 1e-6)) as f32,
        power: part.iter().map(Placed::power).sum::<f64>() as f32,
    }
}

/// A triangle of a lamp. Points on it are barycentric weights.
struct Lamp<'a> {
    scene: &'a Scene,
    textures: &'a Textures,
    mesh: &'a Mesh,
    triangle: &'a [u32],
}

impl Lamp<'_> {
    fn position(&self, w: Vec3) -> Vec3 {
        let corner = |k: usize| self.mesh.positions[self.triangle[k] as usize];
        corner(0) * w.x + corner(1) * w.y + corner(2) * w.z
    }

    /// Corners and mean emission of the pieces: 4^`cuts` of them if the emission varies, else one.
    fn pieces(&self, cuts: u32) -> impl Iterator<Item = ([Vec3; 3], Vec3)> {
        let material = &self.scene.materials[self.mesh.material];
        let varies = material.emissive_texture.is_some()
            || (material.alpha != crate::scene::Alpha::Opaque && material.base_color_texture.is_some());
        let whole = [Vec3::X, Vec3::Y, Vec3::Z];
        let mut parts = vec![whole];
        for _ in 0..if varies { cuts } else { 0 } {
            parts = parts.into_iter().flat_map(quarters).collect();
        }
        let mut lit: Vec<([Vec3; 3], Vec3)> = parts.into_iter().map(|p| (p, self.mean(p))).collect();
        let mean = lit.iter().map(|p| p.1).sum::<Vec3>() / lit.len() as f32;
        let furthest = lit.iter().map(|p| (p.1 - mean).abs().max_element()).fold(0.0, f32::max);
        if furthest <= EVEN * mean.max_element() {
            lit = vec![(whole, mean)];
        }
        lit.into_iter().filter(|p| p.1 != Vec3::ZERO)
    }

    /// Mean emission of a part; holes count as dark.
    fn mean(&self, part: [Vec3; 3]) -> Vec3 {
        let side = GRID as f32;
        let uv_side = |set: usize| {
            let uv = |w: Vec3| self.uv(set, w);
            let (e, f) = (uv(part[1]) - uv(part[0]), uv(part[2]) - uv(part[0]));
            (e.perp_dot(f).abs() / 2.0).sqrt() / side
        };
        let footprint = [uv_side(0), uv_side(1)];
        let points = (0..GRID * GRID).map(|i| {
            let (u, v) = (((i % GRID) as f32 + 0.5) / side, ((i / GRID) as f32 + 0.5) / side);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            self.emission(part[0] * (1.0 - u - v) + part[1] * u + part[2] * v, footprint)
        });
        points.sum::<Vec3>() / (GRID * GRID) as f32
    }

    fn uv(&self, set: usize, w: Vec3) -> Vec2 {
        let corner = |k: usize| self.mesh.uvs[set][self.triangle[k] as usize];
        corner(0) * w.x + corner(1) * w.y + corner(2) * w.z
    }

    fn emission(&self, w: Vec3, footprint: [f32; 2]) -> Vec3 {
        let material = &self.scene.materials[self.mesh.material];
        let color = |k: usize| self.mesh.colors[self.triangle[k] as usize];
        let color = color(0) * w.x + color(1) * w.y + color(2) * w.z;
        let point = SurfacePoint { uvs: [self.uv(0, w), self.uv(1, w)], color, footprint };
        let texel = self.textures.sample(self.scene, material.emissive_texture.as_ref(), ColorSpace::Srgb, &point);
        material.emissive * texel.truncate() * material.opacity(self.scene, self.textures, &point)
    }
}

/// The four triangles between the middles of the sides.
fn quarters([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// A piece in voxels.
#[derive(Clone, Copy)]
struct Placed {
    corners: [DVec3; 3],
    radiance: Vec3,
    shine: f32,
    two_sided: bool,
}

impl Placed {
    fn new(piece: &Piece, voxel_from_object: &DAffine3) -> Self {
        let [a, b, c] = piece.corners.map(|p| voxel_from_object.transform_point3(p.as_dvec3()));
        // A mirrored instance keeps its front side.
        let corners = if voxel_from_object.matrix3.determinant() < 0.0 { [a, c, b] } else { [a, b, c] };
        Self { corners, radiance: piece.radiance, shine: piece.shine, two_sided: piece.two_sided }
    }

    fn record(&self) -> layout::Lamp {
        let [a, b, c] = self.corners.map(|corner| corner.as_vec3().to_array());
        let (radiance, two_sided) = (self.radiance.to_array(), u32::from(self.two_sided));
        layout::Lamp { a, b, c, radiance, two_sided, shine: self.shine }
    }

    /// Unit normal of the front.
    fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// The emitted power up to a common factor.
    fn power(&self) -> f64 {
        let [a, b, c] = self.corners;
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        (b - a).cross(c - a).length() * sides * f64::from(self.radiance.max_element())
    }

    /// The halves of a piece, split at the middle of its longest side.
    fn halves(self) -> [Self; 2] {
        let [a, b, c] = self.corners;
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let longest = sides.iter().fold(sides[0], |l, s| if s.0.distance(s.1) > l.0.distance(l.1) { *s } else { l });
        let (from, to, apex) = longest;
        let middle = (from + to) / 2.0;
        [Self { corners: [from, middle, apex], ..self }, Self { corners: [middle, to, apex], ..self }]
    }

    fn middle(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trees_nodes_hold_their_pieces() {
        for count in [2_usize, 3, 7, 64, 100] {
            let piece = |k: usize| {
                let at = DVec3::new((k * 37 % 50) as f64, (k * 11 % 50) as f64, k as f64);
                let corners = [at, at + DVec3::X, at + DVec3::Y * 2.0];
                Placed { corners, radiance: Vec3::splat(1.0 + k as f32), shine: 1.0, two_sided: k.is_multiple_of(2) }
            };
            let placed = in_halves(&(0..count).map(piece).collect::<Vec<_>>());
            let nodes = tree(&placed);
            assert_eq!(nodes.len(), node_count(count as u32) as usize);
            for (index, p) in placed.iter().enumerate() {
                // The test descends like the shader, by counts of pieces.
                let (mut node, mut first, mut end) = (1, 0, count);
                loop {
                    let sphere = nodes[node];
                    let center = Vec3::from_array(sphere.center).as_dvec3();
                    assert!(p.corners.iter().all(|c| c.distance(center) <= f64::from(sphere.radius)), "{count} {node}");
                    let power: f64 = placed[first..end].iter().map(Placed::power).sum();
                    let cosine = p.normal().dot(Vec3::from_array(sphere.axis).as_dvec3());
                    let least = if p.two_sided { -1.0 } else { cosine };
                    assert!(f64::from(sphere.spread_cosine) <= least + 1e-6);
                    assert!((f64::from(sphere.power) / power - 1.0).abs() < 1e-5);
                    if first + 1 == end {
                        break;
                    }
                    let middle = usize::midpoint(first, end);
                    (node, first, end) =
                        if index < middle { (2 * node, first, middle) } else { (2 * node + 1, middle, end) };
                }
            }
        }
    }
}
