#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Writes the corners of the triangles of an acceleration structure in its order, which is equal in every frame. A
// triangle that was dropped when it was recorded has one corner three times, so that no ray hits it.

#include "common/count.glsl"
#include "common/thread.glsl"

layout(scalar) readonly buffer Slots { uint slots[]; };
layout(scalar) readonly buffer TreeLinks { uint tree_links[]; };
layout(scalar) writeonly buffer QueryCorners { uint query_corners[]; };

const uint APART = 4u; // a recorded triangle takes as much memory as four corners, and begins with its three

layout(push_constant) uniform Push {
    uint count; // of triangles
} push;

void main() {
    uint i = thread();
    if (i >= push.count) {
        return;
    }
    COUNT(WORDS, 2u);
    uint slot = slots[tree_links[1u + i]];
    for (uint k = 0u; k < 3u; k++) {
        query_corners[3u * i + k] = slot == 0u ? 0u : APART * (slot - 1u) + k;
    }
}
