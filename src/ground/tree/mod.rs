//! Tree: boxes around the recorded triangles, for rays. The trees of triangles that move together are built once
//! ([`groups`]); only the tree over the groups is rebuilt with every record. The boxes are refitted to the recorded
//! triangles. Reads: triangles, slots. Writes: tree links (of the tree over the groups), tree boxes.
//! `tests/device/passes_tree.rs` checks it. If the device's ray queries trace rays, an acceleration structure replaces
//! the tree ([`queries`]).

pub mod groups;
pub mod links;
pub mod queries;

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::memory_plan::MemoryRow;
use super::scene_on_gpu::SceneOnGpu;
use super::{Ground, MOST_GROUPS};
use crate::Result;
use crate::scene::{Pose, Scene};
use crate::vk::{
    Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Context, Recorder, ZoneKind, upload, upload_into,
};
use groups::{SceneTrees, TreeSize};
use links::WORDS;
use queries::Queries;

impl TreeSize {
    pub fn plan(&self) -> Vec<MemoryRow> {
        let links = 4 * (WORDS * self.all() + self.triangles);
        vec![("tree links", links as u64), ("tree boxes", (12 * self.all()) as u64)]
    }
}

pub struct Tree {
    /// Nine words per node: the nodes over the groups, the nodes after each group, and those of the groups; then the
    /// sources of the leaves. With queries, the sources of the structure's triangles ([`queries::links`]).
    pub links: Buffer,
    /// One box per node.
    pub boxes: Buffer,
    maker: BoxMaker,
}

/// The part that fits boxes to triangles.
enum BoxMaker {
    /// Nothing, because there are no rays.
    None,
    Passes(Arc<SceneTrees>, Compute),
    Driver(Queries),
}

/// A range of nodes.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RangePush {
    first: u32,
    end: u32,
}

/// An empty box: each side begins at its end (`glsl/ground/tree_nodes.glsl`).
const EMPTY_BOX: [u32; 3] = [0xffff; 3];

impl Tree {
    /// `trees` is `None` without rays; the buffers then only exist to be bound.
    pub fn new(context: &Arc<Context>, constants: &[Constant], trees: Option<Arc<SceneTrees>>) -> Result<Self> {
        let size = trees.as_ref().map_or(TreeSize::default(), |trees| trees.size());
        let [(_, links), (_, boxes)] = size.plan()[..] else { unreachable!("two buffers") };
        let mut tree = Self {
            links: Buffer::new(context, "tree links", links, BufferKind::Device)?,
            boxes: Buffer::new(context, "tree boxes", boxes, BufferKind::Device)?,
            maker: BoxMaker::None,
        };
        if let Some(trees) = trees {
            let mut words = vec![0; WORDS * size.before()];
            words.extend(trees.nodes.as_flattened());
            words.extend(&trees.sources);
            upload_into(context, &tree.links, &words)?;
            // Nodes after groups are never visited, and neither is the only node of an empty tree.
            upload_into(context, &tree.boxes, &vec![EMPTY_BOX; size.before()])?;
            let boxes = ComputeDesc { label: "tree", shader: "ground/tree_boxes.comp", constants };
            tree.maker = BoxMaker::Passes(trees, Compute::new(context, &boxes)?);
        }
        Ok(tree)
    }

    /// Makes an acceleration structure instead of the tree.
    pub fn queried(context: &Arc<Context>, constants: &[Constant], of: &Scene, scene: &SceneOnGpu) -> Result<Self> {
        let links = queries::links(&scene.draws);
        Ok(Self {
            maker: BoxMaker::Driver(Queries::new(context, constants, of, &links)?),
            links: upload(context, "tree links", &links)?,
            boxes: Buffer::new(context, "tree boxes", 0, BufferKind::Device)?,
        })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, pose: &Pose) {
        let (trees, boxes) = match &self.maker {
            BoxMaker::None => return,
            BoxMaker::Passes(trees, boxes) => (trees, boxes),
            BoxMaker::Driver(queries) => {
                let binds = [Bind::buffer("slots", &ground.slots), Bind::buffer("tree_links", &self.links)];
                return recorder.zone("tree", ZoneKind::Compute, queries.bytes(), |r| {
                    queries.record(r, &ground.triangles, &binds);
                });
            }
        };
        let top = trees.top(&pose.world_from_instance);
        let behind = |level: &Range<usize>| level.start + top.nodes.len()..level.end + top.nodes.len();
        let levels = top.levels.iter().cloned().chain(trees.levels.iter().map(behind));
        recorder.zone("tree", ZoneKind::Compute, self.boxes.bytes(), |r| {
            r.full_barrier(); // the previous frame read the tree
            r.update(&self.links, 0, &top.nodes);
            let mut binds = vec![Bind::buffer("triangles", &ground.triangles), Bind::buffer("slots", &ground.slots)];
            binds.extend(self.binds());
            for level in levels.rev() {
                r.full_barrier(); // boxes of a level contain those of the level below
                let push = RangePush { first: level.start as u32, end: level.end as u32 };
                let groups = level.len().div_ceil(64).min(MOST_GROUPS as usize) as u32;
                r.dispatch(boxes, &binds, &push, [groups, 1, 1]);
            }
        });
    }

    /// The resources that rays read.
    pub fn binds(&self) -> Vec<Bind<'_>> {
        let mut binds = vec![Bind::buffer("tree_links", &self.links), Bind::buffer("tree_boxes", &self.boxes)];
        if let BoxMaker::Driver(queries) = &self.maker {
            binds.push(queries.bind());
        }
        binds
    }
}
