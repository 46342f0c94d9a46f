// Lists that grow: which triangles each voxel has, and which voxels have any.

#include "common/count.glsl"
#include "ground/grid_push.glsl"
#include "ground/heads.glsl"
#include "ground/layout.glsl"

layout(scalar) buffer GlobalsBuffer { Globals globals; };
layout(scalar) buffer ListItems { ListItem list_items[]; };
layout(scalar) buffer Heads { uint heads[]; };
layout(scalar) buffer Cells { uint cells[]; };

// Whether a finer box lists what is in there.
bool in_hole(uvec3 voxel) {
    ivec3 at = ivec3(voxel) - grid.hole;
    return all(greaterThanEqual(at, ivec3(0))) && all(lessThan(at, ivec3(grid.hole_edge)));
}

// Puts a triangle into the voxel's list. The item, 1-based; 0 where there is no room.
uint append(uint triangle, uvec3 voxel) {
    uint item = atomicAdd(globals.item_count, 1u) + 1u;
    if (item > uint(list_items.length())) {
        atomicAdd(globals.item_overflow, 1u);
        return 0u;
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
    return item;
}
