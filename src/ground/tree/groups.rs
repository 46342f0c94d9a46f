//! The trees over all triangles of a scene, made once: one over the triangles that no animation moves, and one over each instance that
//! moves or is deformed: then it stands as in its rest pose, and the boxes follow its triangles. Triangles of all meshes stand in one tree, because meshes lie through one another.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DVec3};

use super::links::{Corners, Links, MOST_IN_LEAF, Node, WORDS, bounds, moved, primitives, union};
use crate::scene::Scene;

/// Instances whose triangles keep their places to each other, each with the bounds of its mesh.
type Group = Vec<(usize, Corners)>;

#[derive(Debug, Default)]
pub struct SceneTrees {
    groups: Vec<Group>,
    /// Level by level over all groups, the roots first. They stand behind the tree over the groups and a node per group to which
    /// ways out of it lead.
    pub nodes: Vec<Node>,
    /// Of these, counted from the first.
    pub levels: Vec<Range<usize>>,
    /// Triangles in the order of the leaves: their sources.
    pub sources: Vec<u32>,
}

/// How many nodes there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreeSize {
    pub groups: usize,
    /// Of all groups' trees.
    pub nodes: usize,
    pub triangles: usize,
}

impl TreeSize {
    /// Nodes of the tree over the groups: at least one, also where there is nothing.
    pub fn top(&self) -> usize {
        (2 * self.groups).saturating_sub(1).max(1)
    }

    /// Nodes that stand before those of the groups.
    pub fn before(&self) -> usize {
        self.top() + self.groups
    }

    pub fn all(&self) -> usize {
        self.before() + self.nodes
    }
}

/// Makes the trees of a scene when they are first asked for.
#[derive(Clone, Debug, Default)]
pub struct TreesOnce {
    /// Where instances stood at first.
    pub world_from_instance: Vec<DAffine3>,
    made: OnceLock<Arc<SceneTrees>>,
}

impl TreesOnce {
    pub fn new(world_from_instance: &[DAffine3]) -> Self {
        Self { world_from_instance: world_from_instance.to_vec(), made: OnceLock::new() }
    }

    /// Of `scene`, always the same one.
    pub fn of(&self, scene: &Scene) -> Arc<SceneTrees> {
        self.made.get_or_init(|| Arc::new(SceneTrees::new(scene, &self.world_from_instance))).clone()
    }
}

impl SceneTrees {
    fn new(scene: &Scene, world_from_instance: &[DAffine3]) -> Self {
        let mut first_source = Vec::new();
        let mut triangles = 0;
        for instance in &scene.instances {
            first_source.push(triangles);
            triangles += scene.meshes[instance.mesh].indices.len() as u32 / 3;
        }
        let mesh_bounds = scene.meshes.iter().map(|mesh| bounds(mesh.positions.iter().map(|p| p.as_dvec3())));
        let mesh_bounds: Vec<Corners> = mesh_bounds.collect();
        let mut trees = Self::default();
        let mut all: Vec<Links> = Vec::new();
        for instances in groups(scene) {
            let (mut boxes, mut sources) = (Vec::new(), Vec::new());
            for &index in &instances {
                let (mesh, place) = (&scene.meshes[scene.instances[index].mesh], &world_from_instance[index]);
                let point = |&i: &u32| place.transform_point3(mesh.positions[i as usize].as_dvec3());
                boxes.extend(mesh.indices.chunks_exact(3).map(|corners| bounds(corners.iter().map(point))));
                sources.extend((first_source[index]..).take(mesh.indices.len() / 3));
            }
            let mut links = Links::over(&boxes, MOST_IN_LEAF);
            links.primitives.iter_mut().for_each(|source| *source = sources[*source as usize]);
            all.push(links);
            let with_bounds = |index: usize| (index, mesh_bounds[scene.instances[index].mesh]);
            trees.groups.push(instances.into_iter().map(with_bounds).collect());
        }
        trees.join(&all);
        trees
    }

    /// Puts the trees of all groups together.
    fn join(&mut self, all: &[Links]) {
        let depth = all.iter().map(|links| links.levels.len()).max().unwrap_or(0);
        // Where each group's levels stand.
        let mut places: Vec<Vec<usize>> = vec![Vec::new(); all.len()];
        let mut next = 0;
        for level in 0..depth {
            let first = next;
            for (links, places) in all.iter().zip(&mut places) {
                let Some(nodes) = links.levels.get(level) else { continue };
                places.push(next);
                next += nodes.len();
            }
            self.levels.push(first..next);
        }
        let triangles = all.iter().map(|links| links.primitives.len()).sum();
        let size = TreeSize { groups: all.len(), nodes: next, triangles };
        let first_source = size.all() * WORDS;
        self.nodes = vec![[0; WORDS]; next];
        for (group, (links, places)) in all.iter().zip(&places).enumerate() {
            let place = |node: usize| {
                let level = links.levels.partition_point(|level| level.end <= node);
                size.before() + places[level] + node - links.levels[level].start
            };
            for (at, node) in links.nodes.iter().enumerate() {
                let way_out = (size.top() + group) as u32 + 1;
                let sources = first_source + self.sources.len();
                self.nodes[place(at) - size.before()] = moved(node, place, way_out, sources);
            }
            self.sources.extend(&links.primitives);
        }
    }

    pub fn size(&self) -> TreeSize {
        TreeSize { groups: self.groups.len(), nodes: self.nodes.len(), triangles: self.sources.len() }
    }

    /// The tree over all groups and their ways out, for instances that stand at `world_from_instance`. Its leaves are copies of the
    /// groups' roots.
    pub fn top(&self, world_from_instance: &[DAffine3]) -> Top {
        let size = self.size();
        let about = |group: &Group| {
            let boxes = group.iter().map(|(index, bounds)| placed(bounds, &world_from_instance[*index]));
            boxes.reduce(union).expect("a group has instances")
        };
        let tree = Links::over(&self.groups.iter().map(about).collect::<Vec<_>>(), 1);
        let mut nodes = vec![[0; WORDS]; size.before()];
        for (at, node) in tree.nodes.iter().enumerate() {
            nodes[at] = *node;
            if let Some(of) = primitives(node) {
                let group = tree.primitives[of.start] as usize;
                nodes[size.top() + group] = *node; // never met: only what comes after it counts
                nodes[at][0] = self.nodes[group][0];
            }
        }
        Top { nodes, levels: tree.levels }
    }
}

pub struct Top {
    pub nodes: Vec<Node>,
    pub levels: Vec<Range<usize>>,
}

/// Instances with triangles: first all that nothing moves or deforms, then each other one.
fn groups(scene: &Scene) -> Vec<Vec<usize>> {
    let moves = scene.moving_nodes();
    let solid = |&index: &usize| !scene.meshes[scene.instances[index].mesh].indices.is_empty();
    let (moving, still): (Vec<_>, Vec<_>) = (0..scene.instances.len()).filter(solid).partition(|&index| {
        let instance = scene.instances[index];
        moves[instance.node] || scene.meshes[instance.mesh].deform.is_some()
    });
    let still = (!still.is_empty()).then_some(still);
    still.into_iter().chain(moving.into_iter().map(|index| vec![index])).collect()
}

/// The box about a placed box.
fn placed(corners: &Corners, place: &DAffine3) -> Corners {
    let corner = |i: usize| DVec3::from_array(std::array::from_fn(|axis| corners[i >> axis & 1][axis]));
    bounds((0..8).map(|i| place.transform_point3(corner(i))))
}
