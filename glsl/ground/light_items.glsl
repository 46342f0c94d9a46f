// Lights the items of the lists, a thread per lit item, or adds this pass to the mean of their light. A thread per
// voxel would trace rays in a loop, and llvmpipe ends every loop of an invocation after 65,535 iterations in total.
//! given const bool CLIPS_ITEMS = true;
//! given const bool LIGHTS_FRONTS = false;

#include "common/spread.glsl"
#include "ground/item_light.glsl"
#include "ground/cells.glsl"
#include "ground/boxes.glsl"

layout(scalar) buffer ItemLights { ItemLight item_lights[]; };
layout(scalar) readonly buffer LitItems { uint lit_items[]; };

layout(push_constant) uniform SharesPush {
    uint first; // share of the items, in 1/ITEM_SHARES
    uint end;
} push;

// The block of 64 items at which a share of `count` items begins.
uint share_start(uint count, uint share) {
    return (count / ITEM_SHARES * share + count % ITEM_SHARES * share / ITEM_SHARES) / 64u;
}

void main() {
    // A frame whose lists are too short is made again.
    uint count = globals.item_overflow == 0u ? cell_counts[LISTED].count : 0u;
    uint blocks = (count + 63u) / 64u;
    uint first = share_start(count, push.first);
    uint end = push.end == ITEM_SHARES ? blocks : share_start(count, push.end);
    for (uint turn = gl_WorkGroupID.x; turn < blocks; turn += gl_NumWorkGroups.x) {
        uint block = block_at(turn, blocks);
        uint i = block * 64u + gl_LocalInvocationID.x;
        if (block < first || block >= end || i >= count) {
            continue;
        }
        COUNT(WORDS, LIT == LIT_GROUPED ? 1u : 0u);
        uint item = LIT == LIT_GROUPED ? lit_items[i] : i;
        ListItem entry = list_items[item];
        Box box = box_of(entry.voxel);
        mat3 corners = in_box(box, corners_of(triangles[entry.triangle]));
        ItemLight light = light_item(item, entry.triangle, corners, cell_in(box, entry.voxel));
        if (frame.light_share < 1.0) {
            COUNT(WORDS, 6u);
            light.front = mix(item_lights[item].front, light.front, frame.light_share);
            light.back = mix(item_lights[item].back, light.back, frame.light_share);
        }
#ifndef ASKS
        item_lights[item] = light;
#endif
    }
}
