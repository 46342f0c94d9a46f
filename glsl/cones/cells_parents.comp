#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 2a, cells: the parents of the occupied voxels, each once, listed level by level.

#include "common/layout.glsl"
#include "common/constants.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 32, scalar) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 22, scalar) buffer CellCounts { CellCount cell_counts[]; };
layout(set = 0, binding = 30, scalar) writeonly buffer Parents { uint parents[]; };
layout(set = 0, binding = 31, scalar) buffer Listed { uint listed[]; }; // a bit per cell of every level but the first

void main() {
    uint count = cell_counts[0].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint index = cells[i];
        uvec3 cell = uvec3(index % EDGE, index / EDGE % EDGE, index / (EDGE * EDGE));
        uint first = 0u; // of the level among all parents
        for (uint level = 1u; EDGE >> level != 0u; level++) {
            uint edge = EDGE >> level;
            cell >>= 1u;
            uint parent = (cell.z * edge + cell.y) * edge + cell.x;
            uint bit = 1u << ((first + parent) & 31u);
            if ((atomicOr(listed[(first + parent) >> 5u], bit) & bit) != 0u) {
                break; // and whoever listed it goes on to its parents
            }
            uint place = atomicAdd(cell_counts[level].count, 1u);
            parents[first + place] = parent;
            if (place % 64u == 0u && place / 64u < MOST_GROUPS) {
                atomicAdd(cell_counts[level].groups_x, 1u);
            }
            first += edge * edge * edge;
        }
    }
}
