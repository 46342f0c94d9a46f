//! Binary trees as words: what a ray needs to go through them without a stack.
//!
//! A node has nine words. The first: where its left child stands (1-based; the right one follows) and the axis along
//! which they lie apart in its two low bits. A leaf: where its primitives stand, in bit 2 whether they are two, and 3.
//! Then for each octant of directions (bit per axis: the direction is negative) the node after it and all below it,
//! 1-based, 0 at the end: nearer children come first. (Multiple threaded hierarchies: Hachisuka, "Implementing a
//! Photorealistic Rendering System using GLSL", 2015.)

use std::ops::Range;
use std::time::Duration;

use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};

use crate::scene::ties::break_ties;

/// Of a node.
pub const WORDS: usize = 9;
/// Where the eight nodes after it begin.
pub const NEXT: usize = 1;
/// Primitives of a leaf. Measured in the atrium on llvmpipe: 1 and 2 are as quick, 4 takes 1.05 to 1.1 times as long.
pub const MOST_IN_LEAF: u32 = 2;
const LEAF: u32 = 3;

pub type LinkedNode = [u32; WORDS];

/// A box: its least and its greatest corner.
pub type Corners = [DVec3; 2];

/// Range of primitives that a leaf holds; `None` for an inner node.
pub fn primitives(node: &LinkedNode) -> Option<Range<usize>> {
    let first = (node[0] >> 3) as usize;
    (node[0] & 3 == LEAF).then_some(first..first + (node[0] >> 2 & 1) as usize + 1)
}

/// Where the left child of an inner node stands, the right one follows; none of a leaf.
pub fn left_child(node: &LinkedNode) -> Option<usize> {
    (node[0] & 3 != LEAF).then(|| (node[0] >> 2) as usize - 1)
}

/// The node as it is in a larger tree. `place`: where its children stand there; `end`: what comes after this tree,
/// 1-based; `primitives`: where the first of all leaves' primitives stand.
pub fn moved(node: &LinkedNode, place: impl Fn(usize) -> usize, end: u32, primitives: usize) -> LinkedNode {
    let first = match left_child(node) {
        Some(child) => (place(child) as u32 + 1) << 2 | node[0] & 3,
        None => node[0] + ((primitives as u32) << 3),
    };
    let next = |node: u32| if node == 0 { end } else { place(node as usize - 1) as u32 + 1 };
    std::array::from_fn(|word| if word < NEXT { first } else { next(node[word]) })
}

/// A binary tree over boxes. It does not depend on where these are, nor on their common size.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// Level by level from the root on, children side by side.
    pub nodes: Vec<LinkedNode>,
    pub levels: Vec<Range<usize>>,
    /// The boxes in the order of the leaves.
    pub primitives: Vec<u32>,
}

impl Links {
    /// `most`: boxes in a leaf, up to [`MOST_IN_LEAF`].
    pub fn over(boxes: &[Corners], most: u32) -> Self {
        let Some([min, max]) = boxes.iter().copied().reduce(union) else { return Self::default() };
        // obvhs ignores boxes smaller than 10⁻⁴: all are scaled to a size where none is that matters.
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

    /// Makes node `at` from the tree's node `from`; its children stand last, and in `below`.
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

/// About points; its corners are infinite where there are none.
pub fn bounds(points: impl IntoIterator<Item = DVec3>) -> Corners {
    points.into_iter().map(|p| [p, p]).fold([DVec3::INFINITY, DVec3::NEG_INFINITY], union)
}
