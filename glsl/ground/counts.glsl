// The lengths of the lists of occupied cells, one per level, and of the lists of items (ground/constants.glsl).

#include "ground/constants.glsl"
#include "ground/layout.glsl"

layout(scalar) buffer CellCounts { ListCount cell_counts[]; };

// Counts one more entry; returns its index in the list.
uint take_place(uint entry) {
    uint place = atomicAdd(cell_counts[entry].count, 1u);
    if (place % 64u == 0u && place / 64u < MOST_GROUPS) {
        atomicAdd(cell_counts[entry].groups_x, 1u);
    }
    return place;
}
