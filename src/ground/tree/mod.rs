//! Tree: boxes about the recorded triangles, for rays: trees over the triangles of each mesh's pieces, made once, and one over the
//! pieces of all instances, made anew with every record. Its boxes are put about the triangles as they were recorded, wherever those have moved.
//! Reads: triangles, slots. Writes: tree links (of the pieces), tree boxes. Held by `tests/passes_tree.rs`.

pub mod links;

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::Ground;
use super::layout::{TreeInstance, TreeJoin};
use super::memory_plan::MemoryRow;
use super::scene_on_gpu::{SceneDraw, SceneOnGpu};
use crate::Result;
use crate::scene::{Pose, Scene};
use crate::vk::{Bind, Buffer, BufferKind, Compute, ComputeDesc, Context, Recorder, ZoneKind, upload_into};
use links::{Links, MeshTrees, Piece, WORDS, inner_by_level, left_child, node_count, piece_count};

/// How many nodes there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreeSize {
    /// Of all instances.
    pieces: usize,
    /// Nodes of the tree over these, of all meshes' trees, and of these for every instance.
    top: usize,
    meshes: usize,
    placed: usize,
}

impl TreeSize {
    pub fn of(scene: &Scene) -> Self {
        let triangles = |mesh: usize| scene.meshes[mesh].indices.len() / 3;
        let nodes = |mesh: usize| 2 * triangles(mesh) - piece_count(triangles(mesh));
        let pieces = scene.instances.iter().map(|i| piece_count(triangles(i.mesh))).sum();
        Self {
            pieces,
            top: node_count(pieces).max(1),
            meshes: (0..scene.meshes.len()).map(nodes).sum(),
            placed: scene.instances.iter().map(|i| nodes(i.mesh)).sum(),
        }
    }

    /// Joins of the pieces' inner nodes; those of the tree over them follow.
    fn placed_joins(&self) -> usize {
        (self.placed - self.pieces) / 2
    }

    pub fn plan(&self) -> Vec<MemoryRow> {
        let bytes = |count: usize, each: usize| (count.max(1) * each) as u64;
        vec![
            ("tree links", bytes(self.top + self.pieces + self.meshes, 4 * WORDS)),
            ("tree boxes", bytes(self.top + self.placed, 12)),
            ("tree instances", bytes(self.pieces, size_of::<TreeInstance>())),
            ("tree joins", bytes(self.placed_joins() + self.top, size_of::<TreeJoin>())),
        ]
    }
}

pub struct Tree {
    size: TreeSize,
    pub links: Buffer,
    pub boxes: Buffer,
    pub instances: Buffer,
    joins: Buffer,
    /// Absent where nothing traces rays.
    maker: Option<TreeMaker>,
}

struct TreeMaker {
    trees: Arc<MeshTrees>,
    leaves: Compute,
    join: Compute,
    /// Of the pieces' inner nodes: the deepest ones first.
    levels: Vec<Range<u32>>,
}

/// From one to before another.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RangePush {
    first: u32,
    end: u32,
}

/// What the tree over all pieces is in a pose.
struct Top {
    pieces: Vec<TreeInstance>,
    /// Behind them the pieces once more, which its leaves name: rays have no binding to spare.
    links: Links,
    /// Of each level, from the leaves on.
    joins: Vec<Vec<TreeJoin>>,
}

/// Begins where others end (`glsl/ground/tree_nodes.glsl`).
const EMPTY_BOX: [u32; 3] = [0xffff; 3];
const MOST_GROUPS: u32 = 65535;

impl Tree {
    /// `trees`: none where nothing traces rays; the buffers then are there to be bound.
    pub fn new(
        context: &Arc<Context>,
        constants: &[(u32, u32)],
        (scene, trees): (&SceneOnGpu, Option<Arc<MeshTrees>>),
        size: TreeSize,
    ) -> Result<Self> {
        let plan = size.plan();
        let buffer = |index: usize| Buffer::new(context, plan[index].0, plan[index].1, BufferKind::Device);
        let mut tree =
            Self { size, links: buffer(0)?, boxes: buffer(1)?, instances: buffer(2)?, joins: buffer(3)?, maker: None };
        if let Some(trees) = trees {
            let mut links: Links = vec![[0; WORDS]; size.top + size.pieces];
            links.extend(&trees.links);
            upload_into(context, &tree.links, &links)?;
            let levels = placed_joins(&placed(&size, &trees, &scene.draws), &trees, &scene.draws);
            upload_into(context, &tree.joins, &levels.concat())?;
            let compute = |shader| Compute::new(context, &ComputeDesc { label: "tree", shader, constants });
            let (leaves, join) = (compute("ground/tree_leaves.comp")?, compute("ground/tree_join.comp")?);
            tree.maker = Some(TreeMaker { trees, leaves, join, levels: ranges(0, &levels) });
        }
        Ok(tree)
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, pose: &Pose) {
        let Some(maker) = &self.maker else { return };
        let top = self.top(&maker.trees, &ground.scene.draws, pose);
        let top_levels = ranges(self.size.placed_joins() as u32, &top.joins);
        let nodes = self.size.top as u32..(self.size.top + self.size.placed) as u32;
        let dispatch = |r: &mut Recorder, pipeline: &Compute, binds: &[Bind], of: &Range<u32>| {
            let groups = of.len().div_ceil(64).clamp(1, MOST_GROUPS as usize) as u32;
            r.full_barrier(); // each step goes on from the one before
            r.dispatch(pipeline, binds, &RangePush { first: of.start, end: of.end }, [groups, 1, 1]);
        };
        recorder.zone("tree", ZoneKind::Compute, self.boxes.bytes(), |r| {
            r.full_barrier(); // the frame before read the tree
            r.update(&self.links, 0, &top.links);
            r.update(&self.instances, 0, &top.pieces);
            r.update(&self.boxes, 0, &[EMPTY_BOX]); // stays where there is no triangle
            let first_top = (self.size.placed_joins() * size_of::<TreeJoin>()) as u64;
            r.update(&self.joins, first_top, &top.joins.concat());
            let mut binds = vec![
                Bind::buffer("triangles", &ground.triangles),
                Bind::buffer("slots", &ground.slots),
                Bind::buffer("tree_instances", &self.instances),
            ];
            binds.extend(self.binds());
            dispatch(r, &maker.leaves, &binds, &nodes);
            let binds = [Bind::buffer("tree_boxes", &self.boxes), Bind::buffer("tree_joins", &self.joins)];
            maker.levels.iter().chain(&top_levels).for_each(|level| dispatch(r, &maker.join, &binds, level));
        });
    }

    /// What rays read.
    pub fn binds(&self) -> [Bind<'_>; 2] {
        [Bind::buffer("tree_links", &self.links), Bind::buffer("tree_boxes", &self.boxes)]
    }

    fn top(&self, trees: &MeshTrees, draws: &[SceneDraw], pose: &Pose) -> Top {
        let place = |(draw, piece): (&SceneDraw, &Piece)| {
            links::placed(&piece.bounds, &pose.world_from_instance[draw.instance])
        };
        let mut links = links::of_boxes(&pieces_of(trees, draws).map(place).collect::<Vec<_>>());
        let pieces = placed(&self.size, trees, draws);
        let mut joins = vec![Vec::new()];
        for (node, words) in links.iter_mut().enumerate() {
            if let Some(piece) = links::primitive(words) {
                let root = pieces[piece].boxes;
                joins[0].push(TreeJoin { node: node as u32, first: root, second: root });
                links::set_primitive(words, (self.size.top + piece) as u32);
            }
        }
        joins.extend(joins_by_level(&links, 0));
        let record = |of: &TreeInstance| [of.links, of.boxes, of.source, 0, 0, 0, 0, 0, 0];
        links.extend(pieces.iter().map(record));
        Top { pieces, links, joins }
    }
}

fn pieces_of<'a>(trees: &'a MeshTrees, draws: &'a [SceneDraw]) -> impl Iterator<Item = (&'a SceneDraw, &'a Piece)> {
    draws.iter().flat_map(|draw| trees.pieces[draw.mesh].iter().map(move |piece| (draw, piece)))
}

/// The pieces of all instances: where their nodes stand.
fn placed(size: &TreeSize, trees: &MeshTrees, draws: &[SceneDraw]) -> Vec<TreeInstance> {
    let mut next = size.top;
    let mut place = |(draw, piece): (&SceneDraw, &Piece)| {
        let (links, boxes) = (size.top + size.pieces + piece.nodes.start, next);
        next += piece.nodes.len();
        TreeInstance { links: links as u32, boxes: boxes as u32, source: draw.first_source }
    };
    pieces_of(trees, draws).map(&mut place).collect()
}

/// The joins of one tree's inner nodes, the deepest ones first. `boxes`: its first box.
fn joins_by_level(links: &[[u32; WORDS]], boxes: u32) -> Vec<Vec<TreeJoin>> {
    let join = |&node: &u32| {
        let first = boxes + left_child(&links[node as usize]).expect("an inner node");
        TreeJoin { node: boxes + node, first, second: first + 1 }
    };
    inner_by_level(links).iter().rev().map(|level| level.iter().map(join).collect()).collect()
}

/// The joins of all pieces' inner nodes, those that all others stand on first.
fn placed_joins(placed: &[TreeInstance], trees: &MeshTrees, draws: &[SceneDraw]) -> Vec<Vec<TreeJoin>> {
    let mut all: Vec<Vec<TreeJoin>> = Vec::new();
    for (at, (_, piece)) in placed.iter().zip(pieces_of(trees, draws)) {
        // All roots' level is the last.
        for (level, joins) in joins_by_level(&trees.links[piece.nodes.clone()], at.boxes).into_iter().rev().enumerate()
        {
            all.resize_with(all.len().max(level + 1), Vec::new);
            all[level].extend(joins);
        }
    }
    all.reverse();
    all
}

/// Where each level stands when all of them stand in a row from `first` on.
fn ranges(first: u32, levels: &[Vec<TreeJoin>]) -> Vec<Range<u32>> {
    let mut next = first;
    let mut range = |level: &Vec<TreeJoin>| {
        let first = next;
        next += level.len() as u32;
        first..next
    };
    levels.iter().map(&mut range).filter(|range| !range.is_empty()).collect()
}
