//! Emissive triangles as area lights (`emitters = sampled`): evenly bright pieces, chosen by power. `glsl/common/emitters.glsl`
//! samples them.

use glam::{DAffine3, DVec3, Vec2, Vec3};

use crate::gi::volume::Volume;
use crate::layout;
use crate::scene::surface::SurfacePoint;
use crate::scene::texture::{ColorSpace, Sampling, Textures};
use crate::scene::{Mesh, Pose, Scene};

/// Textured triangles are cut into 4ᵏ pieces, each as bright as its texels in the mean: k at most this.
const MOST_CUTS: u32 = 3;
/// And no more pieces than this in all.
const MOST_PIECES: usize = 1 << 16;
/// Points along each side of a piece at which its emission is looked at.
const GRID: u32 = 4;
/// Pieces that differ by less than this share of the brightest are one.
const EVEN: f32 = 0.01;

/// A triangle in object space that sends the same radiance everywhere.
#[derive(Clone, Copy, Debug)]
struct Piece {
    instance: usize,
    corners: [Vec3; 3],
    radiance: Vec3,
    two_sided: bool,
}

/// The lamps of a scene, made once; a pose places them.
#[derive(Clone, Debug, Default)]
pub struct Emitters {
    pieces: Vec<Piece>,
}

impl Emitters {
    pub fn new(scene: &Scene) -> Self {
        let textures = Textures::new(scene);
        let lamps: Vec<usize> = (0..scene.instances.len())
            .filter(|&i| {
                let m = &scene.materials[scene.meshes[scene.instances[i].mesh].material];
                m.emissive != Vec3::ZERO && !m.unlit
            })
            .collect();
        let triangles: usize = lamps.iter().map(|&i| scene.meshes[scene.instances[i].mesh].indices.len() / 3).sum();
        let cuts = (0..=MOST_CUTS).rev().find(|&k| triangles << (2 * k) <= MOST_PIECES).unwrap_or(0);
        let mut pieces = Vec::new();
        for instance in lamps {
            let mesh = &scene.meshes[scene.instances[instance].mesh];
            for triangle in mesh.indices.chunks_exact(3) {
                let lamp = Lamp { scene, textures: &textures, mesh, triangle };
                pieces.extend(lamp.pieces(cuts).map(|(corners, radiance)| Piece {
                    instance,
                    corners: corners.map(|w| lamp.position(w)),
                    radiance,
                    two_sided: scene.materials[mesh.material].double_sided,
                }));
            }
        }
        Self { pieces }
    }

    /// How many [`Self::place`] makes at most for `samples` points per place that is lit.
    pub fn count(&self, samples: u32) -> u32 {
        if self.pieces.is_empty() { 0 } else { (self.pieces.len() as u32).max(samples) }
    }

    /// What the GPU samples. Fewer lamps than samples are cut until every sample has a piece of its own, all with the same
    /// probability; more are chosen by power, in an order in which neighbours lie side by side.
    pub fn place(&self, pose: &Pose, volume: &Volume, samples: u32) -> Vec<layout::Emitter> {
        let voxel_from_world = volume.voxel_from_world();
        let frames: Vec<DAffine3> = pose.world_from_instance.iter().map(|w| voxel_from_world * *w).collect();
        let mut placed: Vec<Placed> = self.pieces.iter().map(|p| Placed::new(p, &frames[p.instance])).collect();
        placed.retain(|p| p.power() > 0.0);
        if placed.is_empty() {
            return Vec::new();
        }
        let own_piece = placed.len() <= samples as usize;
        while placed.len() < samples as usize {
            let powers = placed.iter().map(Placed::power);
            let (strongest, _) = powers.enumerate().fold((0, -1.0), |a, b| if b.1 > a.1 { b } else { a });
            let halves = placed.swap_remove(strongest).halves();
            placed.extend(halves);
        }
        placed.sort_by_key(Placed::morton);
        let total: f64 = placed.iter().map(Placed::power).sum();
        let count = placed.len() as f64;
        let mut sum = 0.0;
        placed
            .iter()
            .map(|p| {
                let probability = if own_piece { 1.0 / count } else { p.power() / total };
                sum += probability;
                let [a, b, c] = p.corners.map(|corner| corner.as_vec3().to_array());
                layout::Emitter {
                    a,
                    b,
                    c,
                    radiance: p.radiance.to_array(),
                    probability: probability as f32,
                    cumulative: sum as f32,
                    two_sided: u32::from(p.two_sided),
                }
            })
            .collect()
    }
}

/// A triangle of a lamp; points on it are barycentric weights.
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

    /// Corners and mean emission, 4^`cuts` of them where the emission varies, one where it does not.
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

    /// Mean emission of a part, holes counted as dark.
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
        let texel = self.textures.sample(
            self.scene,
            material.emissive_texture.as_ref(),
            ColorSpace::Srgb,
            point.uvs,
            point.footprint,
        );
        material.emissive * texel.truncate() * material.opacity(self.scene, self.textures, &point)
    }
}

/// The four triangles that the middles of the sides make.
fn quarters([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// A piece in voxels.
#[derive(Clone, Copy)]
struct Placed {
    corners: [DVec3; 3],
    radiance: Vec3,
    two_sided: bool,
}

impl Placed {
    fn new(piece: &Piece, voxel_from_object: &DAffine3) -> Self {
        let [a, b, c] = piece.corners.map(|p| voxel_from_object.transform_point3(p.as_dvec3()));
        // A mirrored instance keeps its front.
        let corners = if voxel_from_object.matrix3.determinant() < 0.0 { [a, c, b] } else { [a, b, c] };
        Self { corners, radiance: piece.radiance, two_sided: piece.two_sided }
    }

    /// Up to a factor that is the same for all.
    fn power(&self) -> f64 {
        let [a, b, c] = self.corners;
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        (b - a).cross(c - a).length() * sides * f64::from(self.radiance.max_element())
    }

    /// Cut through the middle of the longest side.
    fn halves(self) -> [Self; 2] {
        let [a, b, c] = self.corners;
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let longest = sides.iter().fold(sides[0], |l, s| if s.0.distance(s.1) > l.0.distance(l.1) { *s } else { l });
        let (from, to, apex) = longest;
        let middle = (from + to) / 2.0;
        [Self { corners: [from, middle, apex], ..self }, Self { corners: [middle, to, apex], ..self }]
    }

    /// Interleaved bits of the voxel in which the middle lies.
    fn morton(&self) -> u32 {
        let middle = (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0;
        let spread = |x: f64| {
            let x = x.clamp(0.0, 1023.0) as u32;
            (0..10).fold(0, |bits, i| bits | ((x >> i) & 1) << (3 * i))
        };
        spread(middle.x) | spread(middle.y) << 1 | spread(middle.z) << 2
    }
}
