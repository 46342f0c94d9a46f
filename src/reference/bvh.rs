//! Rays against triangles: an eight-wide tree collapsed from obvhs' binary one, and packets of eight triangles. Built here,
//! walked in `src/reference/traversal.rs`.
//!
//! Tried on an atrium of 235,248 triangles, processor time for the same image against the step before: this tree instead
//! of obvhs' own compressed eight-wide one 0.82; joined rays eight at a time 0.9 to 1; textures in blocks, on large pages
//! as the tree is, 0.86; joins that keep only what they need 0.96. Packets of four triangles instead of eight, and larger
//! or smaller leaves: nothing beyond the noise of 4 %. Children and textures announced to the processor before they are
//! read 0.92; small functions made ready for inlining across the compiler's units 0.95. Bit for bit the same image. Lanes
//! left to the compiler's own vectorising were no faster than one ray at a time.

use glam::Vec3;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::time::Duration;

use super::lanes::{self, Lanes};
use super::large;

/// Boxes, or rays, at a time.
pub const WIDTH: usize = 8;

/// Eight children.
#[derive(Clone, Copy)]
pub struct Node {
    /// Least x y z, greatest x y z. An empty child's are swapped: nothing meets it.
    pub planes: [Lanes; 6],
    /// A node, or [`LEAF`] and a packet.
    pub children: [u32; WIDTH],
}

pub const LEAF: u32 = 1 << 31;
/// Where a packet has no triangle.
pub const NONE: u32 = u32::MAX;

/// Up to eight triangles.
#[derive(Clone, Copy)]
pub struct Packet {
    /// Per corner, per coordinate. Where there is no triangle: NaN, which nothing meets.
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
        // Without splits every triangle is met at most once, which transparent shadows rely on.
        let params =
            BvhBuildParams { pre_split: false, max_prims_per_leaf: WIDTH as u32, ..BvhBuildParams::slow_build() };
        let mut bvh = Self { nodes: Vec::new(), packets: Vec::new(), avx: lanes::avx() };
        if !soup.is_empty() {
            let binary = build_bvh2_from_tris(&soup, params, &mut Duration::default());
            bvh.nodes.push(Node::EMPTY);
            bvh.fill(0, &binary, 0, triangles);
            (bvh.nodes, bvh.packets) = (large::copy(&bvh.nodes), large::copy(&bvh.packets));
        }
        bvh
    }

    /// Makes node `at` of the binary tree's node `from`.
    fn fill(&mut self, at: usize, binary: &Bvh2, from: usize, triangles: &[[Vec3; 3]]) {
        let mut children = vec![from];
        // The largest child is opened until there are eight.
        while children.len() < WIDTH {
            let area = |&i: &usize| binary.nodes[i].aabb().half_area();
            let inner = (0..children.len()).filter(|&i| !binary.nodes[children[i]].is_leaf());
            let Some(largest) = inner.max_by(|&a, &b| area(&children[a]).total_cmp(&area(&children[b]))) else { break };
            let first = binary.nodes[children[largest]].first_index as usize;
            children.splice(largest..=largest, [first, first + 1]);
        }
        for (lane, child) in children.into_iter().enumerate() {
            let node = &binary.nodes[child];
            let (min, max) = (node.aabb().min, node.aabb().max);
            for axis in 0..3 {
                self.nodes[at].planes[axis].0[lane] = min[axis];
                self.nodes[at].planes[axis + 3].0[lane] = max[axis];
            }
            self.nodes[at].children[lane] = if node.is_leaf() {
                let first = node.first_index as usize;
                let list = &binary.primitive_indices[first..first + node.prim_count as usize];
                self.packets.push(Packet::new(list, triangles));
                LEAF | (self.packets.len() - 1) as u32
            } else {
                self.nodes.push(Node::EMPTY);
                let inner = self.nodes.len() - 1;
                self.fill(inner, binary, child, triangles);
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
