//! The bounding volume hierarchy: an eight-wide tree, collapsed from obvhs' binary tree, with packets of eight
//! triangles as leaves. Built here, traversed in `src/reference/traversal.rs`.
//!
//! Effect of each step on the processor time for one image of an atrium of 235,248 triangles, relative to the previous
//! step: this tree instead of obvhs' compressed eight-wide tree 0.82; connection rays eight at a time 0.9 to 1;
//! textures in blocks, textures and tree on huge pages 0.86; smaller records of connections 0.96; prefetching children
//! and textures 0.92; inlining of small functions across codegen units 0.95; two of glam's vectors instead of one AVX
//! register, and no tests of empty lanes 1.01 (0.97 in the gallery). Packets of four triangles and other leaf sizes had
//! no effect beyond the noise of 4 %. Automatic vectorisation of eight lanes was no faster than single rays. The image
//! has the same bits in all cases.

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use std::time::Duration;

use super::lanes::Lanes;
use super::memory;
use crate::scene::ties::break_ties;

/// The number of lanes: children per node, triangles per packet, rays per bundle.
pub const WIDTH: usize = 8;

/// A node with up to eight children.
#[derive(Clone, Copy)]
pub struct WideNode {
    /// Minimum x y z, then maximum x y z of each child's box. For an empty lane minimum > maximum: no ray hits it.
    pub planes: [Lanes; 6],
    /// The index of a node, or [`LEAF`] | the index of a packet; [`NONE`] in the empty lanes, which come last.
    pub children: [u32; WIDTH],
}

pub const LEAF: u32 = 1 << 31;
/// The child or triangle of an empty lane.
pub const NONE: u32 = u32::MAX;

/// Up to eight triangles.
#[derive(Clone, Copy)]
pub struct Packet {
    /// By corner, then coordinate. NaN in empty lanes: no ray hits them.
    pub corners: [[Lanes; 3]; 3],
    pub triangles: [u32; WIDTH],
}

/// A bounding volume hierarchy over triangles.
pub struct Bvh {
    /// The first is the root.
    pub nodes: Vec<WideNode>,
    pub packets: Vec<Packet>,
}

impl Bvh {
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let mut boxes: Vec<_> = triangles.iter().map(|t| Aabb::from_points(&t.map(Into::into))).collect();
        break_ties(&mut boxes);
        // Without splits every triangle is tested once per ray, as transparent shadows require.
        let params =
            BvhBuildParams { pre_split: false, max_prims_per_leaf: WIDTH as u32, ..BvhBuildParams::slow_build() };
        let mut collapse = Collapse { triangles, ..Collapse::default() };
        if !boxes.is_empty() {
            collapse.binary = build_bvh2(&boxes, params, &mut Duration::default());
            collapse.add(0);
        }
        Self { nodes: memory::huge_page_copy(&collapse.nodes), packets: memory::huge_page_copy(&collapse.packets) }
    }
}

/// The conversion of a binary tree to an eight-wide one.
#[derive(Default)]
struct Collapse<'a> {
    triangles: &'a [[Vec3; 3]],
    binary: Bvh2,
    nodes: Vec<WideNode>,
    packets: Vec<Packet>,
}

impl Collapse<'_> {
    /// Adds the subtree of the inner binary node `root`, or a root that is a leaf. Returns the index of its node.
    fn add(&mut self, root: usize) -> u32 {
        let mut children = vec![root];
        // Replace the largest inner child by its two children until there are eight.
        while children.len() < WIDTH {
            let area = |&i: &usize| self.binary.nodes[i].aabb().half_area();
            let inner = (0..children.len()).filter(|&i| !self.binary.nodes[children[i]].is_leaf());
            let Some(largest) = inner.max_by(|&a, &b| area(&children[a]).total_cmp(&area(&children[b]))) else { break };
            let first = self.binary.nodes[children[largest]].first_index as usize;
            children.splice(largest..=largest, [first, first + 1]);
        }
        let boxes: Vec<_> = children.iter().map(|&child| self.binary.nodes[child].aabb()).collect();
        let plane = |i: usize| {
            Lanes::from_fn(|lane| match boxes.get(lane) {
                Some(aabb) => [aabb.min, aabb.max][i / 3][i % 3],
                None => [f32::INFINITY, f32::NEG_INFINITY][i / 3],
            })
        };
        // The node comes before its children.
        let at = self.nodes.len();
        self.nodes.push(WideNode { planes: std::array::from_fn(plane), children: [NONE; WIDTH] });
        for (lane, child) in children.into_iter().enumerate() {
            let node = &self.binary.nodes[child];
            self.nodes[at].children[lane] = if node.is_leaf() {
                let list = &self.binary.primitive_indices[node.first_index as usize..][..node.prim_count as usize];
                self.packets.push(Packet::new(list, self.triangles));
                LEAF | (self.packets.len() - 1) as u32
            } else {
                self.add(child)
            };
        }
        at as u32
    }
}

impl Packet {
    fn new(list: &[u32], triangles: &[[Vec3; 3]]) -> Self {
        let number = |lane: usize, corner: usize, axis: usize| {
            list.get(lane).map_or(f32::NAN, |&triangle| triangles[triangle as usize][corner][axis])
        };
        let lanes = |corner, axis| Lanes::from_fn(|lane| number(lane, corner, axis));
        Self {
            corners: std::array::from_fn(|corner| std::array::from_fn(|axis| lanes(corner, axis))),
            triangles: std::array::from_fn(|lane| list.get(lane).copied().unwrap_or(NONE)),
        }
    }
}
