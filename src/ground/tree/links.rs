//! Binary trees as words, for traversal without a stack.
//!
//! A node has nine words. The first word of an inner node is the index of its left child (1-based; the right one
//! follows), with the axis along which the children are separated in the two low bits. The first word of a leaf is the
//! index of its primitives, whether there are two (bit 2), and 3 in the low bits. Eight words follow, one per octant of
//! ray directions (a bit per axis for negative directions): the next node after this subtree, 1-based, 0 at the end, so
//! that nearer children come first. (Multiple threaded hierarchies: Hachisuka, "Implementing a Photorealistic Rendering
//! System using GLSL", 2015.)

use std::ops::Range;
use std::time::Duration;

use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};

use crate::scene::ties::break_ties;

/// Words of a node.
pub const WORDS: usize = 9;
/// The first of the eight words with successors.
pub const NEXT: usize = 1;
/// The maximum number of primitives in a leaf. In the atrium on llvmpipe, 1 and 2 take the same time, and 4 takes 1.05
/// to 1.1 times as long.
pub const MOST_IN_LEAF: u32 = 2;
const LEAF: u32 = 3;

pub type LinkedNode = [u32; WORDS];

/// A box: its least and its greatest corner.
pub type Corners = [DVec3; 2];

/// The range of primitives of a leaf; `None` for an inner node.
pub fn primitives(node: &LinkedNode) -> Option<Range<usize>> {
    let first = (node[0] >> 3) as usize;
    (node[0] & 3 == LEAF).then_some(first..first + (node[0] >> 2 & 1) as usize + 1)
}

/// The index of the left child of an inner node, which the right one follows; `None` for a leaf.
pub fn left_child(node: &LinkedNode) -> Option<usize> {
    (node[0] & 3 != LEAF).then(|| (node[0] >> 2) as usize - 1)
}

/// The node within a larger tree. `place` maps its children to their indices there, `end` is the successor of this tree
/// (1-based), and `primitives` is the index of this tree's first primitive.
pub fn moved(node: &LinkedNode, place: impl Fn(usize) -> usize, end: u32, primitives: usize) -> LinkedNode {
    let first = match left_child(node) {
        Some(child) => (place(child) as u32 + 1) << 2 | node[0] & 3,
        None => node[0] + ((primitives as u32) << 3),
    };
    let next = |node: u32| if node == 0 { end } else { place(node as usize - 1) as u32 + 1 };
    std::array::from_fn(|word| if word < NEXT { first } else { next(node[word]) })
}

/// A binary tree over boxes. It does not depend on their position or common scale.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// The nodes, level by level from the root, with siblings adjacent.
    pub nodes: Vec<LinkedNode>,
    pub levels: Vec<Range<usize>>,
    /// The boxes in the order of the leaves.
    pub primitives: Vec<u32>,
}

impl Links {
    /// `most` is the maximum number of boxes in a leaf, up to [`MOST_IN_LEAF`].
    pub fn over(boxes: &[Corners], most: u32) -> Self {
        let Some([min, max]) = boxes.iter().copied().reduce(union) else { return Self::default() };
        // obvhs ignores boxes smaller than 10⁻⁴, so all boxes are scaled up.
        let span = (max - min).max_element();
        let scale = if span > 0.0 { 1024.0 / span } else { 1.0 };
        let scaled = |p: DVec3| ((p - min) * scale).as_vec3().into();
        let mut boxes: Vec<_> = boxes.iter().map(|[min, max]| Aabb { min: scaled(*min), max: scaled(*max) }).collect();
        break_ties(&mut boxes);
        let params =
            BvhBuildParams { max_prims_per_leaf: most, reinsertion_batch_ratio: 0.2, ..BvhBuildParams::medium_build() };
        Self::of_tree(&build_bvh2(&boxes, params, &mut Duration::default()))
    }

    fn of_tree(tree: &Bvh2) -> Self {
        let mut links = Self { nodes: vec![[0; WORDS]], ..Self::default() };
        let mut level = vec![0];
        while !level.is_empty() {
            let first = links.nodes.len() - level.len();
            links.levels.push(first..links.nodes.len());
            let mut below = Vec::new();
            for (at, from) in (first..).zip(level) {
                links.add(tree, from, at, &mut below);
            }
            level = below;
        }
        links
    }

    /// Writes node `at` from the tree's node `from`. Its children are appended, and added to `below`.
    fn add(&mut self, tree: &Bvh2, from: usize, at: usize, below: &mut Vec<usize>) {
        let node = &tree.nodes[from];
        let first = node.first_index as usize;
        if node.is_leaf() {
            let own = &tree.primitive_indices[first..first + node.prim_count as usize];
            self.nodes[at][0] = (self.primitives.len() as u32) << 3 | (own.len() as u32 - 1) << 2 | LEAF;
            self.primitives.extend(own);
            return;
        }
        let center = |child: usize| Vec3::from(tree.nodes[child].aabb().center());
        let apart = center(first + 1) - center(first);
        let axis = apart.abs().max_position();
        below.extend(if apart[axis] < 0.0 { [first + 1, first] } else { [first, first + 1] });
        let left = self.nodes.len() as u32 + 1;
        self.nodes[at][0] = left << 2 | axis as u32;
        let mut children = [[0; WORDS]; 2];
        for octant in 0..8 {
            let near = octant >> axis & 1;
            children[near][NEXT + octant] = left + 1 - near as u32;
            children[1 - near][NEXT + octant] = self.nodes[at][NEXT + octant];
        }
        self.nodes.extend(children);
    }
}

pub fn union(a: Corners, b: Corners) -> Corners {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The bounds of points; infinite without points.
pub fn bounds(points: impl IntoIterator<Item = DVec3>) -> Corners {
    points.into_iter().map(|p| [p, p]).fold([DVec3::INFINITY, DVec3::NEG_INFINITY], union)
}
