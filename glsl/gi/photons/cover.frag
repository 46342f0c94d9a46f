#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Cover: each sample of a triangle finds its voxel, and is counted for the item by which that voxel lists the triangle.
// CPU twin: tests/twins/cover.rs.

#include "common/count.glsl"
#include "ground/heads.glsl"
#include "ground/layout.glsl"
#include "ground/samples.glsl"

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_axis;
layout(location = 2) flat in vec3 in_normal;

layout(scalar) readonly buffer GlobalsBuffer { Globals globals; };
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer Heads { uint heads[]; };
layout(scalar) buffer ItemSamples { uint item_samples[]; };

void count_samples(uvec3 voxel, uint count) {
    uint item = heads[head_index(ivec3(voxel))];
    COUNT(HEADS, 1u);
    bool found = false;
    for (uint k = 0u; k < globals.item_count && item != 0u && !found; k++) {
        COUNT(LIST_ITEMS, 1u);
        found = list_items[item - 1u].triangle == in_triangle;
        if (found) {
            atomicAdd(item_samples[item - 1u], count);
        }
        item = list_items[item - 1u].next;
    }
}

void main() {
    COUNT(CORNERS, 3u);
    vec3 a = triangles[in_triangle].corners[0];
    vec3 b = triangles[in_triangle].corners[1];
    vec3 c = triangles[in_triangle].corners[2];
    Slices slices = slices_of(a, b, c, in_axis, in_normal);
    for (int k = 0; k < 3; k++) {
        uvec3 voxel;
        if (voxel_of(slices, k, in_axis, voxel)) {
            count_samples(voxel, slices.counts[k]);
        }
    }
}
