//! The trees over all triangles of a scene, built once: one over the triangles that no animation moves, and one for
//! each instance that moves or deforms. A deforming instance has its rest pose, and its boxes are refitted later.
//! Triangles of all static meshes share one tree, because meshes interpenetrate. Many triangles are split into parts
//! with a tree each, which are built in parallel and fit into a processor's cache.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use super::links::{Corners, LinkedNode, Links, MOST_IN_LEAF, WORDS, bounds, moved, primitives, union};
use crate::scene::Scene;

/// The maximum number of triangles in a part. A sheet of ten million triangles builds in a quarter of the time of a
/// single tree.
const MOST_IN_PART: usize = 1 << 16;

/// Triangles that move together and share a tree.
#[derive(Clone, Copy, Debug)]
struct Group {
    /// The instance that moves them; `None` for static triangles.
    instance: Option<usize>,
    /// Their bounds in the space of the instance, or in that of the world.
    bounds: Corners,
}

#[derive(Debug, Default)]
pub struct SceneTrees {
    groups: Vec<Group>,
    /// The nodes, level by level over all groups, the roots first. They follow the tree over the groups and one node
    /// per group, which continues a traversal after the group.
    pub nodes: Vec<LinkedNode>,
    /// The ranges of levels among these nodes, counted from the first one.
    pub levels: Vec<Range<usize>>,
    /// The sources of triangles in the order of the leaves.
    pub sources: Vec<u32>,
}

/// The numbers of nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreeSize {
    pub groups: usize,
    /// The number of nodes of all groups' trees.
    pub nodes: usize,
    pub triangles: usize,
}

impl TreeSize {
    /// The number of nodes of the tree over the groups: at least one, even without triangles.
    pub fn top(&self) -> usize {
        (2 * self.groups).saturating_sub(1).max(1)
    }

    /// The number of nodes before those of the groups.
    pub fn before(&self) -> usize {
        self.top() + self.groups
    }

    pub fn all(&self) -> usize {
        self.before() + self.nodes
    }
}

/// Builds the trees of a scene on the first request.
#[derive(Debug, Default)]
pub struct TreesOnce {
    /// The first transforms of instances.
    pub world_from_instance: Vec<DAffine3>,
    made: OnceLock<Arc<SceneTrees>>,
}

impl TreesOnce {
    pub fn new(world_from_instance: &[DAffine3]) -> Self {
        Self { world_from_instance: world_from_instance.to_vec(), made: OnceLock::new() }
    }

    /// The size of the trees of `scene`. Before they are built it is a lower bound, because building takes far longer
    /// than refusing a scene that does not fit.
    pub fn size(&self, scene: &Scene) -> TreeSize {
        let least = || {
            let triangles = scene.triangle_count();
            let leaves = triangles.div_ceil(MOST_IN_LEAF as usize);
            TreeSize { groups: leaves.min(1), nodes: (2 * leaves).saturating_sub(1), triangles }
        };
        self.made.get().map_or_else(least, |trees| trees.size())
    }

    /// The trees of `scene`, which is always the same one.
    pub fn of_scene(&self, scene: &Scene) -> Arc<SceneTrees> {
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
        let mut trees = Self::default();
        let mut all: Vec<Links> = Vec::new();
        for (instances, moves) in placed_together(scene) {
            let (mut boxes, mut sources) = (Vec::new(), Vec::new());
            for &index in &instances {
                let mesh = &scene.meshes[scene.instances[index].mesh];
                let place = if moves { DAffine3::IDENTITY } else { world_from_instance[index] };
                let point = |&i: &u32| place.transform_point3(mesh.positions[i as usize].as_dvec3());
                boxes.par_extend(mesh.indices.par_chunks_exact(3).map(|corners| bounds(corners.iter().map(point))));
                sources.extend((first_source[index]..).take(mesh.indices.len() / 3));
            }
            let instance = moves.then(|| instances[0]);
            let parts: Vec<(Group, Links)> = parts(&boxes)
                .into_par_iter()
                .map(|part| {
                    let own: Vec<Corners> = part.iter().map(|&triangle| boxes[triangle as usize]).collect();
                    let mut links = Links::over(&own, MOST_IN_LEAF);
                    links.primitives.iter_mut().for_each(|place| *place = sources[part[*place as usize] as usize]);
                    let bounds = own.into_iter().reduce(union).expect("a part has triangles");
                    (Group { instance, bounds }, links)
                })
                .collect();
            let (groups, links): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
            trees.groups.extend(groups);
            all.extend(links);
        }
        trees.join(&all);
        trees
    }

    /// Joins the trees of all groups.
    fn join(&mut self, all: &[Links]) {
        let depth = all.iter().map(|links| links.levels.len()).max().unwrap_or(0);
        // The start of each group's levels.
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
        // The nodes of a group on one level, with their places.
        let mut slots = Vec::new();
        let mut left = self.nodes.as_mut_slice();
        for level in 0..depth {
            for (group, links) in all.iter().enumerate().filter(|(_, links)| level < links.levels.len()) {
                let (own, behind) = left.split_at_mut(links.levels[level].len());
                slots.push((group, level, own));
                left = behind;
            }
        }
        // The start of each group's primitives.
        let mut begin = Vec::new();
        for links in all {
            begin.push(first_source + self.sources.len());
            self.sources.extend(&links.primitives);
        }
        slots.into_par_iter().for_each(|(group, level, own)| {
            let (links, places) = (&all[group], &places[group]);
            let place = |node: usize| {
                let level = links.levels.partition_point(|level| level.end <= node);
                size.before() + places[level] + node - links.levels[level].start
            };
            let way_out = (size.top() + group) as u32 + 1;
            for (node, to) in links.nodes[links.levels[level].clone()].iter().zip(own) {
                *to = moved(node, place, way_out, begin[group]);
            }
        });
    }

    pub fn size(&self) -> TreeSize {
        TreeSize { groups: self.groups.len(), nodes: self.nodes.len(), triangles: self.sources.len() }
    }

    /// The tree over all groups, and the nodes that continue after each, for instances at `world_from_instance`. Its
    /// leaves are copies of the groups' roots.
    pub fn top(&self, world_from_instance: &[DAffine3]) -> Top {
        let size = self.size();
        let about =
            |group: &Group| group.instance.map_or(group.bounds, |i| placed(&group.bounds, &world_from_instance[i]));
        let tree = Links::over(&self.groups.iter().map(about).collect::<Vec<_>>(), 1);
        let mut nodes = vec![[0; WORDS]; size.before()];
        for (at, node) in tree.nodes.iter().enumerate() {
            nodes[at] = *node;
            if let Some(of) = primitives(node) {
                let group = tree.primitives[of.start] as usize;
                nodes[size.top() + group] = *node; // never visited: only its successors count
                nodes[at][0] = self.nodes[group][0];
            }
        }
        Top { nodes, levels: tree.levels }
    }
}

pub struct Top {
    pub nodes: Vec<LinkedNode>,
    pub levels: Vec<Range<usize>>,
}

/// Groups of instances whose triangles move together, and whether they move: first all static ones, then each other
/// instance.
fn placed_together(scene: &Scene) -> Vec<(Vec<usize>, bool)> {
    let moves = scene.moving_nodes();
    let solid = |&index: &usize| !scene.meshes[scene.instances[index].mesh].indices.is_empty();
    let (moving, still): (Vec<_>, Vec<_>) = (0..scene.instances.len()).filter(solid).partition(|&index| {
        let instance = scene.instances[index];
        moves[instance.node] || scene.meshes[instance.mesh].deform.is_some()
    });
    let still = (!still.is_empty()).then_some((still, false));
    still.into_iter().chain(moving.into_iter().map(|index| (vec![index], true))).collect()
}

/// The numbers of the boxes, split in halves across the longest extent of their centres until no part has more than
/// [`MOST_IN_PART`].
fn parts(boxes: &[Corners]) -> Vec<Vec<u32>> {
    let center = |[min, max]: &Corners| (0.5 * (min + max)).as_vec3();
    let mut centers: Vec<(Vec3, u32)> = boxes.par_iter().map(center).zip(0..boxes.len() as u32).collect();
    cut(&mut centers)
}

fn cut(centers: &mut [(Vec3, u32)]) -> Vec<Vec<u32>> {
    if centers.len() <= MOST_IN_PART {
        return vec![centers.iter().map(|(_, number)| *number).collect()];
    }
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (min, max) = centers.iter().fold(none, |(min, max), (center, _)| (min.min(*center), max.max(*center)));
    let axis = (max - min).max_position();
    let order = |a: &(Vec3, u32), b: &(Vec3, u32)| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1));
    let middle = centers.len() / 2;
    centers.select_nth_unstable_by(middle, order);
    let (less, more) = centers.split_at_mut(middle);
    let (mut all, behind) = rayon::join(|| cut(less), || cut(more));
    all.extend(behind);
    all
}

/// The bounds of a transformed box.
fn placed(corners: &Corners, place: &DAffine3) -> Corners {
    let corner = |i: usize| DVec3::from_array(std::array::from_fn(|axis| corners[i >> axis & 1][axis]));
    bounds((0..8).map(|i| place.transform_point3(corner(i))))
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::scene::{Material, Mesh};

    #[test]
    fn parts_hold_every_box_once() {
        let at = |i: usize| DVec3::new((i % 7) as f64, (i * i % 1009) as f64, 3.0);
        for (count, most) in [(0, 1), (1, 1), (MOST_IN_PART, 1), (MOST_IN_PART + 1, 2), (5 * MOST_IN_PART, 8)] {
            let boxes: Vec<Corners> = (0..count).map(|i| [at(i), at(i) + 1.0]).collect();
            let parts = parts(&boxes);
            assert_eq!(parts.len(), most);
            assert!(parts.iter().all(|part| part.len() <= MOST_IN_PART));
            let mut all = parts.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count as u32));
        }
    }

    /// A sheet and a cloud of ten million triangles: the trees of each are built in ten seconds on two cores.
    #[test]
    #[ignore = "half a minute, 8 GB: make test-more"]
    fn ten_million_triangles_have_trees_within_ten_seconds() {
        const SIDE: usize = 2237;
        let height = |x: usize, z: usize| 5.0 * ((0.11 * x as f32).sin() + (0.07 * z as f32).cos());
        let at = |x, z| Vec3::new(x as f32, height(x, z), z as f32);
        let square = |place: usize| {
            let (x, z) = (place / SIDE, place % SIDE);
            [[at(x, z), at(x, z + 1), at(x + 1, z)], [at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)]]
        };
        let sheet: Vec<[Vec3; 3]> = (0..SIDE * SIDE).flat_map(square).collect();
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let mut point = || Vec3::from_array([random(), random(), random()]);
        let mut loose = |_: &_| {
            let center = 100.0 * point();
            [center, center + point(), center + point()]
        };
        let cloud: Vec<[Vec3; 3]> = sheet.iter().map(&mut loose).collect();
        for (name, triangles) in [("sheet", sheet), ("cloud", cloud)] {
            let mut scene = Scene::empty(name);
            let material = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
            scene.add_mesh(Mesh::triangles(name, material, &triangles), DAffine3::IDENTITY);
            let began = Instant::now();
            let trees = SceneTrees::new(&scene, &[DAffine3::IDENTITY]);
            let seconds = began.elapsed().as_secs_f64();
            println!("{name}: {seconds:.2} s, {:?}", trees.size());
            let mut sources = trees.sources;
            sources.sort_unstable();
            assert!(sources.into_iter().eq(0..triangles.len() as u32));
            assert!(seconds < 10.0, "{name}: {seconds} s");
        }
    }
}
