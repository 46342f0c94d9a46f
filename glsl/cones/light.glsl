// Shading, cells form, first half: a thread per item of the lists. A thread per voxel would have loops without a bound: llvmpipe
// ends every loop of an invocation once all of them together have gone round 65535 times. Needs: shade.glsl.

#include "cones/cells.glsl"

layout(set = 0, binding = 34, scalar) writeonly buffer ItemLights { ItemLight item_lights[]; };

void main() {
    uint count = cell_counts[ITEM_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        ListItem entry = list_items[i];
        item_lights[i] = shade_item(i, triangles[entry.triangle], cell_at(entry.voxel, EDGE));
    }
}
