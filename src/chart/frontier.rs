//! The frontier: points that no other point dominates.

use std::collections::{BTreeMap, BTreeSet};

/// Indices of the points (cost, error) that no other point dominates, the cheapest first. A point dominates another if
/// it is no worse on one axis and better on the other. Non-finite points are left out; equal points are all kept.
pub fn frontier(points: &[(f64, f64)]) -> Vec<usize> {
    let finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    let mut best: Vec<usize> = (0..points.len())
        .filter(|&i| finite(&points[i]) && !points.iter().any(|other| finite(other) && beats(other, &points[i])))
        .collect();
    best.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0));
    best
}

/// The frontier of each group of points, in the order of groups. `group` holds the group of every point. A point
/// without a group belongs to every group, and if no point has one, all points are one group.
pub fn frontiers<G: Ord>(points: &[(f64, f64)], group: &[Option<G>]) -> Vec<Vec<usize>> {
    let mut members: BTreeMap<Option<&G>, Vec<usize>> = BTreeMap::new();
    let named: BTreeSet<&G> = group.iter().flatten().collect();
    let groups: Vec<Option<&G>> = if named.is_empty() { vec![None] } else { named.into_iter().map(Some).collect() };
    for (i, own) in group.iter().enumerate() {
        let of = groups.iter().filter(|group| own.is_none() || own.as_ref() == **group);
        of.for_each(|group| members.entry(*group).or_default().push(i));
    }
    let of_group = |members: Vec<usize>| {
        let own: Vec<(f64, f64)> = members.iter().map(|&i| points[i]).collect();
        frontier(&own).into_iter().map(|i| members[i]).collect()
    };
    members.into_values().map(of_group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn equal_points_stay_and_ties_on_one_axis_do_not() {
        assert_eq!(frontier(&[(1.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 1.0)]), [0, 1]);
        assert_eq!(frontier(&[(f64::NAN, 0.0), (1.0, 1.0), (0.0, f64::INFINITY)]), [1]);
        assert!(frontier(&[]).is_empty());
    }

    #[test]
    fn groups_do_not_beat_each_other() {
        let points = [(1.0, 1.0), (2.0, 2.0), (3.0, 1.5), (4.0, 4.0)];
        assert_eq!(frontiers(&points, &["a", "b", "b", "b"].map(Some)), [vec![0], vec![1, 2]]);
        assert_eq!(frontiers(&points, &[None::<()>; 4]), [vec![0]]);
        // A point without a group dominates and is dominated in every group.
        assert_eq!(frontiers(&points, &[Some("a"), Some("b"), None, Some("b")]), [vec![0], vec![1, 2]]);
        assert_eq!(frontiers(&points, &[None, Some("a"), Some("b"), Some("b")]), [vec![0], vec![0]]);
    }

    proptest! {
        /// Along the frontier cost rises and error falls, and every other point is dominated by a point on it.
        #[test]
        fn it_is_a_staircase_that_beats_the_rest(points in prop::collection::vec((0.0..4.0f64, 0.0..4.0f64), 1..40)) {
            let best = frontier(&points);
            prop_assert!(best.windows(2).all(|w| points[w[0]].0 < points[w[1]].0 && points[w[0]].1 > points[w[1]].1
                || points[w[0]] == points[w[1]]));
            for (i, p) in points.iter().enumerate() {
                let beaten = best.iter().any(|&b| points[b].0 <= p.0 && points[b].1 <= p.1);
                prop_assert!(best.contains(&i) || beaten);
            }
        }
    }
}
