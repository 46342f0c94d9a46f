// Mips, a thread per parent of an occupied cell.
//! given vec4[7] mip_faces(ivec3 corner) { vec4 faces[7]; return faces; }

#include "ground/cells.glsl"
#include "ground/faces/store.glsl"

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
