//! Sizes of the scene's data and of buffers that grow, and the growth of buffers that were too small.

use super::attributes::CornerWords;
use super::constants::Features;
use super::image::MOST_AT_ONCE;
use super::layout::Globals;
use super::lists::ListCapacity;
use super::tree::groups::TreeSize;
use super::tree::queries::QueryPlan;
use crate::scene::{Alpha, Scene};

/// The number of overlapping blended surfaces that buffers can hold at first. A frame that needs more is repeated.
const BLENDED_LAYERS: u32 = 4;
/// The maximum number of parts into which rows that are shaded at once are split.
const MOST_BLENDED_PARTS: u32 = 4096;

/// Sizes of the scene's data, and capacities of buffers that grow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts {
    pub instances: u32,
    pub triangles: u32,
    pub blended: u32,
    pub lights: u32,
    /// Words of the sky's map and its levels on the device.
    pub sky_words: u32,
    /// The number of lamp pieces.
    pub lamps: u32,
    pub triangle_capacity: u32,
    /// Words of the attributes of a triangle's corner.
    pub corner_words: u32,
    /// The size of the tree, if rays are traced.
    pub tree: TreeSize,
    /// The plan of the acceleration structure, if the device's ray queries trace rays.
    pub query: Option<QueryPlan>,
    /// The capacity for samples that see blended triangles, [`MOST_AT_ONCE`] if that suffices.
    pub blended_samples: u32,
    /// The number of parts into which rows that are shaded at once are split, so that it suffices.
    pub blended_parts: u32,
    /// Capacities of every grid, the base grid first.
    pub lists: Vec<ListCapacity>,
    /// The estimated number of items' sides that send light in the base grid before the first frame.
    pub expected_sides: u32,
}

impl Counts {
    /// Capacities for every triangle of `scene`. `lamps` counts pieces, `lists` has capacities of every grid, and
    /// `samples` is that of the image.
    pub fn of_scene(scene: &Scene, lamps: u32, tree: TreeSize, lists: Vec<ListCapacity>, samples: u32) -> Self {
        let is_blended = |mesh: usize| scene.materials[scene.meshes[mesh].material].alpha == Alpha::Blend;
        let blended = scene.instances.iter().filter(|i| is_blended(i.mesh));
        let blended = blended.map(|i| scene.meshes[i.mesh].indices.len() / 3).sum::<usize>() as u32;
        let triangles = scene.triangle_count() as u32;
        let triangle_capacity = triangles.max(1);
        let seen_blended = if blended > 0 { samples.saturating_mul(BLENDED_LAYERS) } else { 1 };
        Self {
            instances: scene.instances.len() as u32,
            triangles,
            blended,
            lights: (scene.lights.len() + scene.sky_lights().count()) as u32,
            sky_words: scene.sky_map.as_ref().map_or(1, |map| map.words.len() as u32),
            lamps,
            triangle_capacity,
            corner_words: CornerWords::of_features(Features::of_scene(scene)).count as u32,
            tree,
            query: None,
            blended_samples: seen_blended.min(MOST_AT_ONCE),
            blended_parts: seen_blended.div_ceil(MOST_AT_ONCE).clamp(1, BLENDED_LAYERS),
            lists,
            expected_sides: 0,
        }
    }

    /// Capacities that can hold the numbers in `counters` (one per grid, as read from the device); unchanged if nothing
    /// overflowed.
    pub fn grown(&self, counters: &[Globals]) -> Self {
        let grown = |capacity: u32, needed: u32, overflow: u32| {
            // An eighth is spare, so that a moving scene does not grow again at once.
            if overflow == 0 { capacity } else { needed.saturating_add(needed / 8) }
        };
        let base = &counters[0];
        let lists = self.lists.iter().zip(counters).map(|(capacity, found)| ListCapacity {
            items: grown(capacity.items, found.item_count, found.item_overflow),
            cells: grown(capacity.cells, found.cell_count, found.cell_overflow),
            ..*capacity
        });
        let samples = grown(self.blended_samples, base.blended_samples, base.blended_samples);
        // Even a single sample per row may see more than the limit, and its row must still fit.
        let parts = if self.blended_parts < MOST_BLENDED_PARTS { samples.div_ceil(MOST_AT_ONCE) } else { 1 };
        Self {
            triangle_capacity: grown(self.triangle_capacity, base.vertex_count / 3, base.triangle_overflow),
            blended_samples: if parts > 1 { MOST_AT_ONCE } else { samples },
            blended_parts: self.blended_parts * parts,
            lists: lists.collect(),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_for_blended_samples_grows_to_its_most_and_then_rows_are_cut() {
        let mut counts = Counts::of_scene(
            &Scene::empty("veils"),
            0,
            TreeSize::default(),
            vec![ListCapacity { items: 1, cells: 1, boxes: 0 }],
            1000,
        );
        let mut grown = |blended_samples: u32| {
            counts = counts.grown(&[Globals { blended_samples, ..bytemuck::Zeroable::zeroed() }]);
            (counts.blended_samples, counts.blended_parts)
        };
        assert_eq!(grown(0), (1, 1), "nothing is blended");
        assert_eq!(grown(8000), (9000, 1));
        assert_eq!(grown(3 * MOST_AT_ONCE), (MOST_AT_ONCE, 4));
        assert_eq!(grown(MOST_AT_ONCE + 1), (MOST_AT_ONCE, 8));
        assert_eq!(grown(0), (MOST_AT_ONCE, 8));
    }
}
