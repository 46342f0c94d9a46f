// Lists that grow: the triangles of each voxel, and the occupied voxels.

#include "common/count.glsl"
#include "ground/grid_push.glsl"
#include "ground/heads.glsl"
#include "ground/layout.glsl"

layout(scalar) buffer GlobalsBuffer { Globals globals; };
layout(scalar) buffer ListItems { ListItem list_items[]; };
layout(scalar) buffer Heads { uint heads[]; };
layout(scalar) buffer Cells { uint cells[]; };

// Whether a finer box lists the content of the cell.
bool in_hole(uvec3 voxel) {
    ivec3 at = ivec3(voxel) - grid.hole;
    return all(greaterThanEqual(at, ivec3(0))) && all(lessThan(at, ivec3(grid.hole_edge)));
}

// Reserves room for `count` items; returns the first, 1-based.
uint take_items(uint count) {
    return atomicAdd(globals.item_count, count) + 1u;
}

// Adds a triangle to the voxel's list as a reserved item, or only counts it if there is no room; returns whether there
// is.
bool put(uint item, uint triangle, uvec3 voxel) {
    if (item > uint(list_items.length())) {
        atomicAdd(globals.item_overflow, 1u);
        return false;
    }
    uint index = grid.first + uint(head_index(ivec3(voxel)));
    uint next = atomicExchange(heads[index], item);
    COUNT(HEADS, 1u);
    list_items[item - 1u].triangle = triangle;
    list_items[item - 1u].next = next;
    list_items[item - 1u].voxel = index;
    if (next == 0u) {
        uint cell = atomicAdd(globals.cell_count, 1u);
        if (cell < uint(cells.length())) {
            cells[cell] = index;
        } else {
            atomicAdd(globals.cell_overflow, 1u);
        }
    }
    return true;
}
