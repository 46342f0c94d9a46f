// Lights the items of the lists, a thread per item that is lit. A thread per voxel would have rays in a loop: llvmpipe
// ends every loop of an invocation once all of them together have gone round 65535 times.

#include "ground/item_light.glsl"
#include "ground/cells.glsl"

layout(set = 0, binding = 22, scalar) writeonly buffer ItemLights { ItemLight item_lights[]; };
layout(set = 0, binding = 24, scalar) readonly buffer LitItems { uint lit_items[]; };

void main() {
    uint count = cell_counts[LIT_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        COUNT(WORDS, LIT == LIT_ALIKE ? 1u : 0u);
        uint item = LIT == LIT_ALIKE ? lit_items[i] : i;
        ListItem entry = list_items[item];
        Triangle t = triangles[entry.triangle];
        item_lights[item] = light_item(item, t, corners_of(t), cell_at(entry.voxel, EDGE));
    }
}
