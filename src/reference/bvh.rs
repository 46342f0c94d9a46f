//! The bounding volume hierarchy: an eight-wide tree, collapsed from obvhs' binary tree, with packets of eight triangles as
//! leaves. Built here, traversed in `src/reference/traversal.rs`.
//!
//! Measured on an atrium of 235,248 triangles: the processor time of each step for the same image, relative to the step
//! before. This tree instead of obvhs' compressed eight-wide tree: 0.82. Connection rays eight at a time: 0.9 to 1.
//! Textures in blocks, textures and tree on huge pages: 0.86. Smaller records of connections: 0.96. Prefetching children
//! and textures: 0.92. Small functions marked for inlining across codegen units: 0.95. No effect beyond the noise of 4 %:
//! packets of four triangles, larger or smaller leaves. Automatic vectorisation of eight lanes was no faster than single
//! rays. The image has the same bits in all.

use glam::Vec3;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::time::Duration;

use super::lanes::{self, Lanes};
use super::memory;

/// Lanes: children per node, triangles per packet, rays per bundle.
pub const WIDTH: usize = 8;

/// A node with up to eight children.
#[derive(Clone, Copy)]
pub struct Node {
    /// Minimum x y z, then maximum x y z of each child's box. For an empty lane minimum > maximum: no ray hits it.
    pub planes: [Lanes; 6],
    /// The index of a node, or [`LEAF`] | the index of a packet.
    pub children: [u32; WIDTH],
}

pub const LEAF: u32 = 1 << 31;
/// The triangle index of an empty lane.
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
    pub nodes: Vec<Node>,
    pub packets: Vec<Packet>,
    pub avx: bool,
}

impl Bvh {
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let soup: Vec<_> =
            triangles.iter().map(|t| Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() }).collect();
        // Without splits every triangle is tested once per ray, as transparent shadows require.
        let params =
            BvhBuildParams { pre_split: false, max_prims_per_leaf: WIDTH as u32, ..BvhBuildParams::slow_build() };
        let mut collapse = Collapse { triangles, ..Collapse::default() };
        if !soup.is_empty() {
            collapse.binary = build_bvh2_from_tris(&soup, params, &mut Duration::default());
            collapse.nodes.push(Node::EMPTY);
            collapse.fill(0, 0);
        }
        let (nodes, packets) = (memory::huge_page_copy(&collapse.nodes), memory::huge_page_copy(&collapse.packets));
        Self { nodes, packets, avx: lanes::avx() }
    }
}

/// The conversion of a binary tree to an eight-wide one.
#[derive(Default)]
struct Collapse<'a> {
    triangles: &'a [[Vec3; 3]],
    binary: Bvh2,
    nodes: Vec<Node>,
    packets: Vec<Packet>,
}

impl Collapse<'_> {
    /// Fills node `at` with the subtree of the binary node `root`.
    fn fill(&mut self, at: usize, root: usize) {
        let mut children = vec![root];
        // Replace the largest inner child by its two children until there are eight.
        while children.len() < WIDTH {
            let area = |&i: &usize| self.binary.nodes[i].aabb().half_area();
            let inner = (0..children.len()).filter(|&i| !self.binary.nodes[children[i]].is_leaf());
            let Some(largest) = inner.max_by(|&a, &b| area(&children[a]).total_cmp(&area(&children[b]))) else { break };
            let first = self.binary.nodes[children[largest]].first_index as usize;
            children.splice(largest..=largest, [first, first + 1]);
        }
        for (lane, child) in children.into_iter().enumerate() {
            let node = &self.binary.nodes[child];
            let (min, max) = (node.aabb().min, node.aabb().max);
            for axis in 0..3 {
                self.nodes[at].planes[axis].0[lane] = min[axis];
                self.nodes[at].planes[axis + 3].0[lane] = max[axis];
            }
            self.nodes[at].children[lane] = if node.is_leaf() {
                let first = node.first_index as usize;
                let list = &self.binary.primitive_indices[first..first + node.prim_count as usize];
                self.packets.push(Packet::new(list, self.triangles));
                LEAF | (self.packets.len() - 1) as u32
            } else {
                self.nodes.push(Node::EMPTY);
                let inner = self.nodes.len() - 1;
                self.fill(inner, child);
                inner as u32
            };
        }
    }
}

impl Node {
    const EMPTY: Self = Self {
        planes: {
            let (least, greatest) = (Lanes([f32::INFINITY; WIDTH]), Lanes([f32::NEG_INFINITY; WIDTH]));
            [least, least, least, greatest, greatest, greatest]
        },
        children: [0; WIDTH],
    };
}

impl Packet {
    fn new(list: &[u32], triangles: &[[Vec3; 3]]) -> Self {
        let mut packet = Self { corners: [[Lanes([f32::NAN; WIDTH]); 3]; 3], triangles: [NONE; WIDTH] };
        for (lane, &triangle) in list.iter().enumerate() {
            packet.triangles[lane] = triangle;
            for (corner, position) in triangles[triangle as usize].iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[corner][axis].0[lane] = position[axis];
                }
            }
        }
        packet
    }
}
