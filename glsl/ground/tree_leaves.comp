#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Puts the boxes of leaves about the recorded triangles: a thread per node of an instance. tree_join.comp makes the others of them.
// tests/twins/tree.rs holds every box.

#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "ground/tree_nodes.glsl"
#include "common/count.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 2, scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(set = 0, binding = 14, scalar) readonly buffer Slots { uint slots[]; };
layout(set = 0, binding = 32, scalar) readonly buffer TreeLinks { uint tree_links[]; };
layout(set = 0, binding = 56, scalar) writeonly buffer TreeBoxes { uvec3 tree_boxes[]; };
layout(set = 0, binding = 57, scalar) readonly buffer TreeInstances { TreeInstance tree_instances[]; };

layout(push_constant) uniform Push {
    uint first; // node
    uint end;
} push;

uvec3 box_about(vec3 low, vec3 high) {
    // A plane to spare on each side: rays' distances are rounded, and a hit may lie a hair outside of its triangle.
    uvec3 begin = uvec3(clamp(floor(low * planes_per_voxel()), 0.0, 65535.0));
    uvec3 end = uvec3(clamp(ceil(high * planes_per_voxel()) + 2.0, 0.0, 65535.0));
    return begin | end << 16u;
}

// Of a triangle; one that was dropped when it was recorded has none.
uvec3 box_of(uint source) {
    uint slot = slots[source];
    uint place = max(slot, 1u) - 1u;
    vec3 a = triangles[place].vertices[0].position;
    vec3 b = triangles[place].vertices[1].position;
    vec3 c = triangles[place].vertices[2].position;
    COUNT(CORNERS, 3u);
    uvec3 box = box_about(min(a, min(b, c)), max(a, max(b, c)));
    return slot == 0u ? uvec3(EMPTY_BOX) : box;
}

TreeInstance instance_of(uint node) {
    uint low = 0u;
    uint high = uint(tree_instances.length());
    for (uint k = 0u; k < 32u && high - low > 1u; k++) {
        uint middle = (low + high) / 2u;
        bool before = tree_instances[middle].boxes <= node;
        low = before ? middle : low;
        high = before ? high : middle;
    }
    return tree_instances[low];
}

void main() {
    for (uint node = push.first + gl_GlobalInvocationID.x; node < push.end; node += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        TreeInstance instance = instance_of(node);
        uint word = tree_links[NODE_WORDS * (instance.links + node - instance.boxes)];
        if ((word & 3u) == LEAF) {
            tree_boxes[node] = box_of(instance.source + (word >> 2u));
        }
    }
}
