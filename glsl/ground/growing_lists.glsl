// For passes that make lists out of the occupied voxels: as cells.glsl, with counts that can be written.

#include "ground/heads.glsl"
#include "ground/layout.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer Cells { uint cells[]; };
layout(scalar) buffer CellCounts { ListCount cell_counts[]; };

// Counts one more; where it goes in its list.
uint take_place(uint entry) {
    uint place = atomicAdd(cell_counts[entry].count, 1u);
    if (place % 64u == 0u && place / 64u < MOST_GROUPS) {
        atomicAdd(cell_counts[entry].groups_x, 1u);
    }
    return place;
}
