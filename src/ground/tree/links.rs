//! Binary trees as words: what a ray needs to go through them without a stack.
//!
//! A node has nine words. The first: where its left child stands (1-based; the right one follows) and the axis along which they lie
//! apart in its two low bits, or its primitive and 3. Then for each octant of directions (bit per axis: the direction is negative)
//! the node after it and all below it, 1-based, 0 at the end: nearer children come first. Children stand after their parents.
//! (Multiple threaded hierarchies: Hachisuka, "Implementing a Photorealistic Rendering System using GLSL", 2015.)

use std::ops::Range;
use std::time::Duration;

use glam::{DAffine3, DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};

use crate::scene::{Mesh, Scene};

/// Of a node.
pub const WORDS: usize = 9;
const NEXT: usize = 1;
const LEAF: u32 = 3;

/// Puts something else into a leaf.
pub fn set_primitive(node: &mut [u32; WORDS], primitive: u32) {
    node[0] = primitive << 2 | LEAF;
}

/// What a leaf holds; none of an inner node.
pub fn primitive(node: &[u32; WORDS]) -> Option<usize> {
    (node[0] & 3 == LEAF).then_some((node[0] >> 2) as usize)
}

/// Where the left child of an inner node stands, the right one follows; none of a leaf.
pub fn left_child(node: &[u32; WORDS]) -> Option<u32> {
    (node[0] & 3 != LEAF).then_some((node[0] >> 2) - 1)
}

/// The inner nodes of every level, the root's first.
pub fn inner_by_level(links: &[[u32; WORDS]]) -> Vec<Vec<u32>> {
    let mut depth = vec![0; links.len()];
    let mut levels = Vec::new();
    for (node, words) in links.iter().enumerate() {
        let Some(left) = left_child(words) else { continue };
        let level: usize = depth[node];
        (depth[left as usize], depth[left as usize + 1]) = (level + 1, level + 1);
        levels.resize(levels.len().max(level + 1), Vec::new());
        levels[level].push(node as u32);
    }
    levels
}

pub type Links = Vec<[u32; WORDS]>;

/// How many nodes a tree of so many primitives has: one primitive per leaf.
pub fn node_count(primitives: usize) -> usize {
    (2 * primitives).saturating_sub(1)
}

/// A box: its least and its greatest corner.
pub type Corners = [DVec3; 2];

/// The tree over boxes. Its words do not depend on where the boxes are, nor on their common size.
pub fn of_boxes(boxes: &[Corners]) -> Links {
    let Some([min, max]) = boxes.iter().copied().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else { return vec![] };
    // obvhs ignores boxes smaller than 10⁻⁴: all are scaled to a size where none is that matters.
    let span = (max - min).max_element();
    let scale = if span > 0.0 { 1024.0 / span } else { 1.0 };
    let scaled = |p: DVec3| ((p - min) * scale).as_vec3().into();
    let boxes: Vec<_> = boxes.iter().map(|corners| Aabb { min: scaled(corners[0]), max: scaled(corners[1]) }).collect();
    let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
    in_words(&build_bvh2(&boxes, params, &mut Duration::default()))
}

fn in_words(tree: &Bvh2) -> Links {
    let mut links: Links = vec![[0; WORDS]];
    let mut open = vec![(0, 0)];
    while let Some((from, at)) = open.pop() {
        let node = &tree.nodes[from];
        if node.is_leaf() {
            links[at][0] = tree.primitive_indices[node.first_index as usize] << 2 | LEAF;
            continue;
        }
        let center = |child: usize| Vec3::from(tree.nodes[child].aabb().center());
        let (mut left, mut right) = (node.first_index as usize, node.first_index as usize + 1);
        let apart = center(right) - center(left);
        let axis = apart.abs().max_position();
        if apart[axis] < 0.0 {
            (left, right) = (right, left);
        }
        let first = links.len();
        links[at][0] = (first as u32 + 1) << 2 | axis as u32;
        let mut children = [[0; WORDS]; 2];
        for octant in 0..8 {
            let near = octant >> axis & 1;
            children[near][NEXT + octant] = (first + (1 - near)) as u32 + 1;
            children[1 - near][NEXT + octant] = links[at][NEXT + octant];
        }
        links.extend(children);
        open.extend([(right, first + 1), (left, first)]);
    }
    links
}

/// Triangles that stand together in a tree, at most: meshes may lie through one another, so that the tree over all pieces parts
/// space far better than a tree per mesh. Of a large mesh more, so that there are not too many pieces to be put in order for a frame.
fn most_in_piece(triangles: usize) -> usize {
    (triangles / 1024).max(64)
}

/// Into how many pieces a mesh of so many triangles is cut.
pub fn piece_count(triangles: usize) -> usize {
    fn halves(triangles: usize, most: usize) -> usize {
        if triangles <= most {
            triangles.min(1)
        } else {
            halves(triangles / 2, most) + halves(triangles.div_ceil(2), most)
        }
    }
    halves(triangles, most_in_piece(triangles))
}

/// Some of a mesh's triangles, with a tree of their own.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Where it stands among the links.
    pub nodes: Range<usize>,
    /// About it, in the mesh's own space.
    pub bounds: Corners,
}

/// Trees over the triangles of meshes.
#[derive(Debug, Default)]
pub struct MeshTrees {
    pub links: Links,
    /// Of every mesh.
    pub pieces: Vec<Vec<Piece>>,
}

impl MeshTrees {
    /// `world_from_instance`: where instances stand at first. A mesh's triangles are put in order as its first instance has them.
    pub fn new(scene: &Scene, world_from_instance: &[DAffine3]) -> Self {
        let mut trees = Self::default();
        for (index, mesh) in scene.meshes.iter().enumerate() {
            let place = scene.instances.iter().position(|instance| instance.mesh == index);
            let place = place.map_or(DAffine3::IDENTITY, |instance| world_from_instance[instance]);
            let boxes = triangle_boxes(mesh, &place);
            let mut triangles: Vec<u32> = (0..boxes.len() as u32).collect();
            let mut pieces = Vec::new();
            halve(&mut triangles, &boxes, most_in_piece(boxes.len()), &mut |piece| {
                let own: Vec<Corners> = piece.iter().map(|&triangle| boxes[triangle as usize]).collect();
                let first = trees.links.len();
                trees.links.extend(of_boxes(&own));
                for node in &mut trees.links[first..] {
                    if let Some(at) = primitive(node) {
                        set_primitive(node, piece[at]);
                    }
                }
                let corners = |&triangle: &u32| &mesh.indices[3 * triangle as usize..][..3];
                let points = piece.iter().flat_map(corners).map(|&i| mesh.positions[i as usize].as_dvec3());
                pieces.push(Piece { nodes: first..trees.links.len(), bounds: bounds(points) });
            });
            trees.pieces.push(pieces);
        }
        trees
    }
}

/// Cuts triangles in two where half of them lie on each side, until there are at most `most`.
fn halve(triangles: &mut [u32], boxes: &[Corners], most: usize, keep: &mut impl FnMut(&[u32])) {
    if triangles.len() <= most {
        if !triangles.is_empty() {
            keep(triangles);
        }
        return;
    }
    let center = |&triangle: &u32| boxes[triangle as usize][0] + boxes[triangle as usize][1];
    let [min, max] = bounds(triangles.iter().map(center));
    let axis = (max - min).max_position();
    let half = triangles.len() / 2;
    triangles.select_nth_unstable_by(half, |a, b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(b)));
    let (before, behind) = triangles.split_at_mut(half);
    halve(before, boxes, most, keep);
    halve(behind, boxes, most, keep);
}

fn bounds(points: impl IntoIterator<Item = DVec3>) -> Corners {
    let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.into_iter().fold(empty, |b, p| [b[0].min(p), b[1].max(p)])
}

fn triangle_boxes(mesh: &Mesh, place: &DAffine3) -> Vec<Corners> {
    let point = |&i: &u32| place.transform_point3(mesh.positions[i as usize].as_dvec3());
    mesh.indices.chunks_exact(3).map(|corners| bounds(corners.iter().map(point))).collect()
}

/// The box about a placed box.
pub fn placed(corners: &Corners, place: &DAffine3) -> Corners {
    let corner = |i: usize| DVec3::from_array(std::array::from_fn(|axis| corners[i >> axis & 1][axis]));
    bounds((0..8).map(|i| place.transform_point3(corner(i))))
}
