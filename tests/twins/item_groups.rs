//! Twin of the pass that groups items: the triangles of a voxel's list that are lit once for all.

use std::collections::BTreeMap;

use glam::DVec3;

/// One listed triangle.
#[derive(Clone, Copy, Debug)]
pub struct Listed {
    /// The normal, of any length but 0.
    pub normal: DVec3,
    pub material: u32,
    /// Whether the triangle may share light with others: it is neither masked nor blended.
    pub shares: bool,
}

/// The cell of the unit cube's surface that `normal` points to: its face (±1 to ±3), and its third along the next two
/// axes.
pub fn facing_cell(normal: DVec3) -> (i32, [i32; 2]) {
    let size = normal.abs();
    let axis = (0..3).rev().max_by(|&a, &b| size[a].total_cmp(&size[b])).expect("three axes");
    let third = |k: usize| {
        let along = normal[(axis + k) % 3] / size[axis];
        if along < -1.0 / 3.0 {
            -1
        } else if along < 1.0 / 3.0 {
            0
        } else {
            1
        }
    };
    ((axis as i32 + 1) * normal[axis].signum() as i32, [third(1), third(2)])
}

/// The list in groups, of which one item is lit for all, as indices into it: in each cell of directions the triangles
/// with the lowest material are a group, all others stay alone.
pub fn groups(list: &[Listed]) -> Vec<Vec<usize>> {
    let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (place, listed) in list.iter().enumerate() {
        cells.entry(facing_cell(listed.normal)).or_default().push(place);
    }
    let mut groups = Vec::new();
    for places in cells.values() {
        let lowest = places.iter().filter(|&&p| list[p].shares).map(|&p| list[p].material).min();
        let (together, alone): (Vec<_>, Vec<_>) =
            places.iter().partition(|&&p| list[p].shares && Some(list[p].material) == lowest);
        groups.extend((!together.is_empty()).then_some(together));
        groups.extend(alone.into_iter().map(|p| vec![p]));
    }
    groups
}
