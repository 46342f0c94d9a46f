#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Requests the light of all items. A thread per occupied voxel.

#include "common/count.glsl"
#include "ground/ask.glsl"
#include "ground/bindings.glsl"
#include "ground/cells.glsl"

layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };

void main() {
    uint count = cell_counts[0].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        COUNT(HEADS, 1u);
        for (uint item = heads[cells[i]]; item != 0u; item = list_items[item - 1u].next) {
            COUNT(LIST_ITEMS, 1u);
            COUNT(WORDS, 1u);
            if (item_parts[item - 1u].lit_by == item - 1u) {
                ask(item - 1u, ASKED_FIRST | ASKED_SECOND);
            }
        }
    }
}
