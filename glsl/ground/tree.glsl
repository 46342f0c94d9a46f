// Traversal of the tree of all triangles: nearer boxes first, without a stack.
//
// A CPU device executes both sides of every branch and only leaves loops early. Therefore one loop passes boxes, and
// triangles are tested outside of it. The device also ends every loop of an invocation after 65,535 iterations in total
// (Mesa, gallivm). Loops are left at their heads, where no work is pending for lanes that have left.

#include "common/count.glsl"
#include "ground/tree_nodes.glsl"

layout(scalar) readonly buffer Slots { uint slots[]; }; // source → 1 + place among the triangles
layout(scalar) readonly buffer TreeLinks { uint tree_links[]; };
layout(scalar) readonly buffer TreeBoxes { uvec3 tree_boxes[]; };

struct Traversal {
    vec3 inverse; // distance to a plane = plane × inverse + bias
    vec3 bias;
    uvec3 begins; // shifts to the plane of a box at which the ray enters
    uint octant;
    float enter; // distances between which the ray lies in the volume
    float leave;
    uint node; // 1-based; 0: the end
};

Traversal start_traversal(vec3 origin, vec3 d) {
    COUNT(RAYS_BEGUN, 1u);
    Traversal w;
    vec3 inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    w.inverse = inverse / planes_per_voxel();
    w.bias = -(origin * planes_per_voxel() + 1.0) * w.inverse;
    bvec3 negative = lessThan(inverse, vec3(0.0));
    w.begins = mix(uvec3(0u), uvec3(16u), negative);
    w.octant = (negative.x ? 1u : 0u) | (negative.y ? 2u : 0u) | (negative.z ? 4u : 0u);
    vec3 t0 = -origin * inverse;
    vec3 t1 = (vec3(float(EDGE)) - origin) * inverse;
    vec3 near = min(t0, t1);
    vec3 far = max(t0, t1);
    w.enter = max(near.x, max(near.y, near.z));
    w.leave = min(far.x, min(far.y, far.z));
    w.node = w.enter <= w.leave && w.leave >= 0.0 ? 1u : 0u;
    return w;
}

// Advances to the next leaf whose box the ray meets between the distances `least` and `most`. Returns its first word;
// 0, like a leaf without triangles, at the end.
uint next_leaf(inout Traversal w, float least, float most) {
    uint leaf = 0u;
    for (uint k = 0u; k < 65535u && leaf == 0u && w.node != 0u; k++) {
        COUNT(RAY_STEPS, 1u);
        uvec3 box = tree_boxes[w.node - 1u];
        vec3 near = vec3((box >> w.begins) & 0xffffu) * w.inverse + w.bias;
        vec3 far = vec3((box >> (16u - w.begins)) & 0xffffu) * w.inverse + w.bias;
        float t0 = max(max(near.x, least), max(near.y, near.z));
        float t1 = min(min(far.x, most), min(far.y, far.z));
        bool met = t0 <= t1;
        uint word = tree_links[NODE_WORDS * (w.node - 1u) + (met ? 0u : NODE_NEXT + w.octant)];
        bool at_leaf = met && (word & 3u) == LEAF;
        leaf = at_leaf ? word : 0u;
        w.node = at_leaf ? w.node : met ? (word >> 2u) + ((w.octant >> (word & 3u)) & 1u) : word;
    }
    return leaf;
}

// Continues after the current leaf.
void pass_leaf(inout Traversal w, bool done) {
    if (done && w.node != 0u) {
        w.node = tree_links[NODE_WORDS * (w.node - 1u) + NODE_NEXT + w.octant];
    }
}

// 1 + the index of triangle `i` of a leaf; 0 if it was dropped.
uint leaf_triangle(uint leaf, uint i) {
    return slots[tree_links[leaf_first(leaf) + i]];
}
