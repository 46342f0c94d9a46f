#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Fits the boxes of one level of the tree to the recorded triangles, or to the boxes of the level below, which were
// fitted before. tests/twins/tree.rs checks every box.

#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "ground/tree_nodes.glsl"
#include "common/count.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer Slots { uint slots[]; };
layout(scalar) readonly buffer TreeLinks { uint tree_links[]; };
layout(scalar) buffer TreeBoxes { uvec3 tree_boxes[]; };

layout(push_constant) uniform Push {
    uint first; // node
    uint end;
} push;

uvec3 about_boxes(uvec3 a, uvec3 b) {
    return min(a & 0xffffu, b & 0xffffu) | max(a >> 16u, b >> 16u) << 16u;
}

uvec3 about_points(vec3 low, vec3 high) {
    // One plane on each side is spare: distances of rays are rounded, and a hit may lie slightly outside of its
    // triangle.
    uvec3 begin = uvec3(clamp(floor(low * planes_per_voxel()), 0.0, 65535.0));
    uvec3 end = uvec3(clamp(ceil(high * planes_per_voxel()) + 2.0, 0.0, 65535.0));
    return begin | end << 16u;
}

// A triangle that was dropped when it was recorded has no box.
uvec3 about_triangle(uint source) {
    uint slot = slots[source];
    uint place = max(slot, 1u) - 1u;
    vec3 a = triangles[place].corners[0];
    vec3 b = triangles[place].corners[1];
    vec3 c = triangles[place].corners[2];
    COUNT(CORNERS, 3u);
    uvec3 box = about_points(min(a, min(b, c)), max(a, max(b, c)));
    return slot == 0u ? uvec3(EMPTY_BOX) : box;
}

void main() {
    for (uint node = push.first + gl_GlobalInvocationID.x; node < push.end;
         node += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint word = tree_links[NODE_WORDS * node];
        COUNT(WORDS, 4u);
        uvec3 box = uvec3(EMPTY_BOX);
        if ((word & 3u) == LEAF) {
            for (uint i = 0u; i < leaf_count(word); i++) {
                box = about_boxes(box, about_triangle(tree_links[leaf_first(word) + i]));
            }
        } else {
            uint child = (word >> 2u) - 1u;
            COUNT(WORDS, 6u);
            box = about_boxes(tree_boxes[child], tree_boxes[child + 1u]);
        }
        tree_boxes[node] = box;
    }
}
