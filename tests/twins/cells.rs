//! Twins of the passes `cells` and `clearance`, over a grid of edge `edge`.

use std::collections::BTreeSet;

use twobounce::ground::clearance::BRICK;

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

/// What `glsl/ground/clearance_code.glsl` says of every voxel of a grid, of which some are `occupied`.
pub fn clearance_codes(occupied: &[bool], edge: u32) -> Vec<u32> {
    const MOST_NEAR: u32 = 4;
    const MOST_REACH: u32 = 12;
    let voxels = distances(occupied, edge);
    let edge_bricks = edge / BRICK;
    let brick_of = |voxel: u32| {
        let [x, y, z] = cell_at(voxel, edge).map(|k| k / BRICK);
        ((z * edge_bricks + y) * edge_bricks + x) as usize
    };
    let mut bricks = vec![false; edge_bricks.pow(3) as usize];
    (0..edge.pow(3)).filter(|&voxel| occupied[voxel as usize]).for_each(|voxel| bricks[brick_of(voxel)] = true);
    let reach = distances(&bricks, edge_bricks);
    let code = |voxel: u32| match (voxels[voxel as usize], reach[brick_of(voxel)]) {
        (near, _) if near < MOST_NEAR => near,
        (_, reach) if reach > 1 => reach.min(MOST_REACH) + MOST_NEAR - 1,
        _ => MOST_NEAR,
    };
    (0..edge.pow(3)).map(code).collect()
}

/// Chebyshev distance from every cell to the nearest that is set; u32::MAX where none is.
fn distances(set: &[bool], edge: u32) -> Vec<u32> {
    let cells: Vec<_> = (0..edge.pow(3)).filter(|&cell| set[cell as usize]).map(|cell| cell_at(cell, edge)).collect();
    let nearest = |cell| {
        let at = cell_at(cell, edge);
        cells.iter().map(|other| (0..3).map(|k| at[k].abs_diff(other[k])).max().unwrap_or(0)).min().unwrap_or(u32::MAX)
    };
    (0..edge.pow(3)).map(nearest).collect()
}
