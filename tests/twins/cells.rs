//! Twin of the pass `cells`, over a grid of edge `edge`.

use std::collections::BTreeSet;

/// Column, row and slice of a cell: as in `glsl/ground/heads.glsl`.
fn cell_at(cell: u32, edge: u32) -> [u32; 3] {
    [cell % edge, cell / edge % edge, cell / edge / edge]
}

/// The cells of each level of a grid of edge `edge` that have an occupied voxel of `cells` in them.
pub fn parents(cells: &[u32], edge: u32) -> Vec<BTreeSet<u32>> {
    let at = |cell: u32, level: u32| {
        let [x, y, z] = cell_at(cell, edge);
        let edge = edge >> level;
        ((z >> level) * edge + (y >> level)) * edge + (x >> level)
    };
    (0..=edge.ilog2()).map(|level| cells.iter().map(|&cell| at(cell, level)).collect()).collect()
}
