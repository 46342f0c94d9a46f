#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Cells: lists the parents of the occupied voxels once each, level by level.

#include "ground/layout.glsl"
#include "ground/constants.glsl"
#include "ground/cells.glsl"

layout(scalar) writeonly buffer Parents { uint parents[]; };
layout(scalar) buffer Listed { uint listed[]; }; // a bit per cell of every level but the first

void main() {
    uint count = cell_counts[0].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        if (cells[i] >= EDGE * EDGE * EDGE) {
            continue; // finer boxes have no parents
        }
        uvec3 cell = cell_at(cells[i], EDGE);
        uint first = 0u; // start of the level among all parents
        for (uint level = 1u; EDGE >> level != 0u; level++) {
            uint edge = EDGE >> level;
            cell >>= 1u;
            uint parent = (cell.z * edge + cell.y) * edge + cell.x;
            uint bit = 1u << ((first + parent) & 31u);
            if ((atomicOr(listed[(first + parent) >> 5u], bit) & bit) != 0u) {
                break; // the thread that listed it continues with its parents
            }
            parents[first + take_place(level)] = parent;
            first += edge * edge * edge;
        }
    }
}
