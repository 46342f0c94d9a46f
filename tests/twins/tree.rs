//! What the pass `tree` must leave: boxes that hold what lies below them, and ways through them that leave nothing out.

use std::sync::Arc;

use twobounce::ground::layout::{TreeInstance, Triangle};
use twobounce::ground::tree::links::{WORDS, primitive};
use twobounce::renderer::Renderer;
use twobounce::vk::{Context, download};

const NEXT: usize = 1;

/// The tree of a frame as the device holds it.
pub struct Tree {
    links: Vec<[u32; WORDS]>,
    boxes: Vec<[u32; 3]>,
    instances: Vec<TreeInstance>,
    triangles: Vec<Triangle>,
    slots: Vec<u32>,
    edge: u32,
}

/// A node: of the links, and of the boxes.
#[derive(Clone, Copy)]
struct Place(usize, usize);

impl Tree {
    pub fn of(context: &Arc<Context>, renderer: &Renderer) -> Self {
        let ground = renderer.ground();
        Self {
            links: download(context, &ground.tree.links).expect("links"),
            boxes: download(context, &ground.tree.boxes).expect("boxes"),
            instances: download(context, &ground.tree.instances).expect("instances"),
            triangles: download(context, &ground.triangles).expect("triangles"),
            slots: download(context, &ground.slots).expect("slots"),
            edge: ground.desc.grid.edge,
        }
    }

    /// Holds every box against what is below it, and every way. Returns how many recorded triangles the tree holds.
    ///
    /// # Panics
    /// Where something is missing, twice there, or outside of its box.
    pub fn check(&self) -> usize {
        let mut seen = vec![0_u32; self.triangles.len()];
        for octant in 0..8 {
            let mut instances = vec![0_u32; self.instances.len()];
            for leaf in self.leaves((0, 0), octant) {
                let record = primitive(&self.links[leaf.0]).expect("a leaf");
                let index = record - (2 * self.instances.len() - 1);
                let instance = self.instances[index];
                instances[index] += 1;
                assert_eq!(self.links[record][..3], [instance.links, instance.boxes, instance.source]);
                let (links, boxes) = (instance.links as usize, instance.boxes as usize);
                assert_eq!(self.boxes[leaf.1], self.boxes[boxes], "an instance's node is its root's box");
                for leaf in self.leaves((links, boxes), octant) {
                    let source = instance.source as usize + primitive(&self.links[leaf.0]).expect("a leaf");
                    match self.slots[source] {
                        0 => assert_eq!(self.boxes[leaf.1], [0xffff; 3], "a triangle that was dropped has no box"),
                        slot => {
                            seen[slot as usize - 1] += 1;
                            self.check_leaf(slot as usize - 1, self.boxes[leaf.1]);
                        }
                    }
                }
                self.check_inner((links, boxes));
            }
            assert!(
                instances.iter().all(|&times| times == 1),
                "octant {octant}: instances are met {instances:?} times"
            );
        }
        self.check_inner((0, 0));
        assert!(seen.iter().all(|&times| times == 0 || times == 8), "a triangle is met once on each octant's way");
        seen.iter().filter(|&&times| times > 0).count()
    }

    /// All leaves, in the order of a way that meets every box.
    fn leaves(&self, (links, boxes): (usize, usize), octant: usize) -> Vec<Place> {
        let (mut node, mut leaves, mut steps) = (1, Vec::new(), 0);
        while node != 0 {
            let at = Place(links + node - 1, boxes + node - 1);
            let words = &self.links[at.0];
            if primitive(words).is_some() {
                leaves.push(at);
                node = words[NEXT + octant] as usize;
            } else {
                let (left, axis) = ((words[0] >> 2) as usize, words[0] & 3);
                let near = left + (octant >> axis & 1);
                let far = 2 * left + 1 - near;
                assert_eq!(
                    self.links[links + near - 1][NEXT + octant] as usize,
                    far,
                    "what is far comes after what is near"
                );
                assert_eq!(self.links[links + far - 1][NEXT + octant], words[NEXT + octant]);
                node = near;
            }
            steps += 1;
            assert!(steps <= 2 * self.links.len(), "a way goes round");
        }
        leaves
    }

    /// A box's planes lie one to two planes outside of its triangle.
    fn check_leaf(&self, slot: usize, found: [u32; 3]) {
        let corners = self.triangles[slot].vertices.map(|vertex| vertex.position);
        for axis in 0..3 {
            let planes = corners.map(|p| f64::from(p[axis]) * 65533.0 / f64::from(self.edge) + 1.0);
            let [low, high] =
                [planes.iter().copied().fold(f64::MAX, f64::min), planes.iter().copied().fold(f64::MIN, f64::max)];
            let [begin, end] = [found[axis] & 0xffff, found[axis] >> 16].map(f64::from);
            let within =
                |x: f64, least: f64, most: f64| (least.clamp(0.0, 65535.0)..=most.clamp(0.0, 65535.0)).contains(&x);
            assert!(within(begin, low - 2.01, low - 0.99), "axis {axis}: {begin} for {low}");
            assert!(within(end, high + 0.99, high + 2.01), "axis {axis}: {end} for {high}");
        }
    }

    /// An inner box is its children's.
    fn check_inner(&self, (links, boxes): (usize, usize)) {
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            let words = &self.links[links + node];
            if primitive(words).is_some() {
                continue;
            }
            let left = (words[0] >> 2) as usize - 1;
            let [a, b] = [left, left + 1].map(|child| self.boxes[boxes + child]);
            let both: [u32; 3] = std::array::from_fn(|axis| {
                (a[axis] & 0xffff).min(b[axis] & 0xffff) | (a[axis] >> 16).max(b[axis] >> 16) << 16
            });
            assert_eq!(self.boxes[boxes + node], both);
            open.extend([left, left + 1]);
        }
    }
}
