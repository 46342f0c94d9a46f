#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Puts boxes of the tree about two others each, of one level at a time: the levels below were done before.

#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "common/count.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 56, scalar) buffer TreeBoxes { uvec3 tree_boxes[]; };
layout(set = 0, binding = 58, scalar) readonly buffer TreeJoins { TreeJoin tree_joins[]; };

layout(push_constant) uniform Push {
    uint first; // join
    uint end;
} push;

void main() {
    for (uint i = push.first + gl_GlobalInvocationID.x; i < push.end; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        TreeJoin join = tree_joins[i];
        COUNT(WORDS, 9u);
        uvec3 a = tree_boxes[join.first];
        uvec3 b = tree_boxes[join.second];
        tree_boxes[join.node] = min(a & 0xffffu, b & 0xffffu) | max(a >> 16u, b >> 16u) << 16u;
    }
}
