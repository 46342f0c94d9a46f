//! Breaks ties between boxes for the tree builder obvhs. It joins pairs of boxes that are each other's nearest
//! neighbours. If all are equally near, as in a row of equal triangles or many at one place, it joins only one pair per
//! step, and building takes quadratic time.

use glam::Vec3A;
use obvhs::aabb::Aabb;

/// The number of equal boxes that is tolerated, because so few cost nothing.
const MANY: u8 = 16;
/// The maximum growth of a box, relative to its size and absolute in a scene that is 1024 wide. It exceeds rounding
/// errors.
const SHARE: f32 = 0.02;
const LEAST: f32 = 1.0 / 4096.0;
/// Lower bound of the growth of boxes at one place, which have no other difference.
const LEAST_OF_SAME: f32 = 1.0 / 64.0;

/// Enlarges each of many boxes of equal size by another small amount.
pub(crate) fn break_ties(boxes: &mut [Aabb]) {
    let (mut sizes, mut places) = (HashCounts::new(boxes.len()), HashCounts::new(boxes.len()));
    for (index, aabb) in boxes.iter_mut().enumerate() {
        let size = aabb.max - aabb.min;
        let same = places.many([aabb.min, aabb.max].map(|corner| corner.to_array()).as_flattened());
        if !sizes.many(&size.to_array()) && !same {
            continue;
        }
        let least = if same { LEAST_OF_SAME } else { LEAST };
        let most = (SHARE * size.max_element()).max(least);
        let grown = |side: u64| most * (mixed(6 * index as u64 + side) >> 40) as f32 / (1 << 24) as f32;
        aabb.min -= Vec3A::new(grown(0), grown(1), grown(2));
        aabb.max += Vec3A::new(grown(3), grown(4), grown(5));
    }
}

/// Counts of numbers, by hash.
struct HashCounts(Vec<u8>);

impl HashCounts {
    fn new(most: usize) -> Self {
        Self(vec![0; most.next_power_of_two()])
    }

    /// Whether these numbers were counted many times.
    fn many(&mut self, numbers: &[f32]) -> bool {
        let hash = numbers.iter().fold(0, |hash, number| mixed(hash ^ u64::from(number.to_bits())));
        let slot = hash as usize & (self.0.len() - 1);
        self.0[slot] = self.0[slot].saturating_add(1);
        self.0[slot] > MANY
    }
}

/// A hash in which every bit depends on every input bit (the finaliser of SplitMix64).
pub(crate) fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ number >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ number >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ number >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_boxes_stay_and_many_grow_apart() {
        let cube = |at: f32| Aabb { min: [at; 3].into(), max: [at + 1.0; 3].into() };
        let row: Vec<Aabb> = (0..100).map(|i| cube(i as f32)).collect();
        let mut few = row[..16].to_vec();
        break_ties(&mut few);
        assert!(few.iter().zip(&row).all(|(a, b)| a.min == b.min && a.max == b.max));
        for (many, most) in [
            (row, SHARE),
            (vec![cube(5.0); 100], SHARE),
            (vec![Aabb { min: [5.0; 3].into(), max: [5.0; 3].into() }; 100], LEAST_OF_SAME),
        ] {
            let mut grown = many.clone();
            break_ties(&mut grown);
            let by = |(a, b): (&Aabb, &Aabb)| (b.min - a.min).max(a.max - b.max).max_element();
            let by: Vec<f32> = grown.iter().zip(&many).map(by).collect();
            // The tolerance covers rounding of the sides.
            assert!(by[16..].iter().all(|by| *by > 0.0 && *by <= most + 1e-4), "{by:?}");
            assert!(by[17..].windows(2).all(|by| by[0] != by[1]), "{by:?}");
        }
    }
}
