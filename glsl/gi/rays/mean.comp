#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The mean, over passes that look along different directions, of what each list item sends. A thread per lit item.
#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "common/count.glsl"
#include "ground/cells.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 22, scalar) readonly buffer ItemLights { ItemLight item_lights[]; };
layout(set = 0, binding = 24, scalar) readonly buffer LitItems { uint lit_items[]; };
layout(set = 0, binding = 29, scalar) buffer SeenLights { ItemLight seen_lights[]; };

layout(push_constant) uniform Push {
    float share; // of the newest pass
} push;

void main() {
    uint count = cell_counts[LIT_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint item = lit_items[i];
        COUNT(WORDS, 25u);
        ItemLight fresh = item_lights[item];
        if (push.share < 1.0) {
            fresh.front = mix(seen_lights[item].front, fresh.front, push.share);
            fresh.back = mix(seen_lights[item].back, fresh.back, push.share);
        }
        seen_lights[item] = fresh;
    }
}
