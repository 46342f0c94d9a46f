// Empties the cells that the last frame filled and this one does not.
//! given void empty_cell(uvec3 cell) {}

#include "ground/cells.glsl"

layout(scalar) readonly buffer Heads { uint heads[]; };
layout(scalar) readonly buffer Listed { uint listed[]; };

layout(push_constant) uniform Push {
    uint level;
    uint first; // of the level's list among the cells
} push;

bool occupied_now(uint cell) {
    uint parent = push.first + cell;
    return push.level == 0u ? heads[cell] != 0u : (listed[parent >> 5u] & 1u << (parent & 31u)) != 0u;
}

void main() {
    uint count = cell_counts[push.level].count;
    uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    uint i = gl_GlobalInvocationID.x;
    while (i < count) {
        // Most cells are occupied again, and are skipped in a loop of their own.
        while (i < count && occupied_now(cells[push.first + i])) {
            i += stride;
        }
        if (i < count) {
            empty_cell(cell_at(cells[push.first + i], EDGE >> push.level));
        }
        i += stride;
    }
}
