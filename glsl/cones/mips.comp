#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Mips, cells form: a thread per parent of an occupied cell.

#include "common/layout.glsl"
#include "common/constants.glsl"
#include "cones/cells.glsl"
#include "cones/faces.glsl"
#include "cones/mips.glsl"

layout(push_constant) uniform Push {
    uint level;
    uint first; // of the level's list among the cells
} push;

void main() {
    uint count = cell_counts[push.level].count;
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) {
        return;
    }
    do {
        uvec3 cell = cell_at(cells[push.first + i], EDGE >> push.level);
        store_faces(cell, mip_faces(2 * ivec3(cell)));
        i += gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    } while (i < count);
}
