//! Checks of the output of the pass `tree`: boxes contain all that lies below them, and traversals leave nothing out.

use std::sync::Arc;

use twobounce::ground::layout::Triangle;
use twobounce::ground::tree::links::{NEXT, WORDS, left_child, primitives};
use twobounce::renderer::Renderer;
use twobounce::vk::{Context, download};

/// The tree of a frame on the device.
pub struct Tree {
    /// Nodes, and behind them sources.
    words: Vec<u32>,
    boxes: Vec<[u32; 3]>,
    triangles: Vec<Triangle>,
    slots: Vec<u32>,
    edge: u32,
}

impl Tree {
    pub fn of_renderer(context: &Arc<Context>, renderer: &Renderer) -> Self {
        let ground = renderer.ground();
        Self {
            words: download(context, &ground.tree.links).expect("links"),
            boxes: download(context, &ground.tree.boxes).expect("boxes"),
            triangles: download(context, &ground.triangles).expect("triangles"),
            slots: download(context, &ground.slots).expect("slots"),
            edge: ground.desc.grid.edge,
        }
    }

    fn node(&self, node: usize) -> &[u32; WORDS] {
        self.words[WORDS * node..][..WORDS].try_into().expect("nine words")
    }

    /// Checks every box against its content, and every traversal. Returns the number of recorded triangles in the tree.
    ///
    /// # Panics
    /// If one is missing, listed twice, or outside of its box.
    pub fn check(&self) -> usize {
        let mut seen = vec![0_u32; self.triangles.len()];
        for octant in 0..8 {
            for leaf in self.leaves(octant) {
                let sources = primitives(self.node(leaf)).expect("a leaf").map(|word| self.words[word] as usize);
                let places: Vec<usize> =
                    sources.filter_map(|source| (self.slots[source] as usize).checked_sub(1)).collect();
                places.iter().for_each(|&place| seen[place] += 1);
                self.check_leaf(self.boxes[leaf], &places);
            }
        }
        assert!(seen.iter().all(|&times| times == 0 || times == 8), "a triangle is met once on each octant's way");
        seen.iter().filter(|&&times| times > 0).count()
    }

    /// All leaves, in the order of a traversal that meets every non-empty box. The inner boxes on it come with their
    /// children.
    fn leaves(&self, octant: usize) -> Vec<usize> {
        let (mut node, mut leaves, mut steps) = (1, Vec::new(), 0);
        while node != 0 {
            let (at, words) = (node - 1, self.node(node - 1));
            let after = words[NEXT + octant] as usize;
            node = match left_child(words) {
                _ if self.boxes[at].iter().any(|&planes| (planes & 0xffff) > planes >> 16) => after,
                None => {
                    leaves.push(at);
                    after
                }
                Some(left) => {
                    assert_eq!(self.boxes[at], about_both(self.boxes[left], self.boxes[left + 1]));
                    let near = left + (octant >> (words[0] & 3) & 1);
                    let far = 2 * left + 1 - near;
                    assert_eq!(self.node(near)[NEXT + octant] as usize, far + 1, "far comes after near");
                    near + 1
                }
            };
            steps += 1;
            assert!(steps <= 2 * self.boxes.len(), "a way goes round");
        }
        leaves
    }

    /// A box's planes lie one to two planes outside of its triangles.
    fn check_leaf(&self, found: [u32; 3], places: &[usize]) {
        let corners: Vec<_> = places.iter().flat_map(|&place| self.triangles[place].corners).collect();
        for axis in 0..3 {
            let planes = corners.iter().map(|p| f64::from(p[axis]) * 65533.0 / f64::from(self.edge) + 1.0);
            let (low, high) = planes.fold((f64::MAX, f64::MIN), |(low, high), plane| (low.min(plane), high.max(plane)));
            let [begin, end] = [found[axis] & 0xffff, found[axis] >> 16].map(f64::from);
            let within =
                |x: f64, least: f64, most: f64| (least.clamp(0.0, 65535.0)..=most.clamp(0.0, 65535.0)).contains(&x);
            assert!(within(begin, low - 2.01, low - 0.99), "axis {axis}: {begin} for {low}");
            assert!(within(end, high + 0.99, high + 2.01), "axis {axis}: {end} for {high}");
        }
    }
}

fn about_both(a: [u32; 3], b: [u32; 3]) -> [u32; 3] {
    std::array::from_fn(|axis| (a[axis] & 0xffff).min(b[axis] & 0xffff) | (a[axis] >> 16).max(b[axis] >> 16) << 16)
}
