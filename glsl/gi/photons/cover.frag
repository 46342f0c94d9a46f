#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Cover: a pixel is a column of voxels, its samples are points of the triangle. Each finds the voxel that it lies in, and the item
// by which that voxel lists the triangle counts it. CPU twin: tests/twins/cover.rs.

#include "common/count.glsl"
#include "gi/photons/constants.glsl"
#include "ground/heads.glsl"
#include "ground/layout.glsl"

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_axis;
layout(location = 2) flat in vec3 in_normal;

layout(set = 0, binding = 1, scalar) readonly buffer GlobalsBuffer { Globals globals; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Heads { uint heads[]; };
layout(set = 0, binding = 55, scalar) buffer ItemSamples { uint item_samples[]; };

// Vulkan's standard sample locations, in sixteenths of a pixel.
const vec2 FOUR[4] = vec2[4](vec2(6, 2), vec2(14, 6), vec2(2, 10), vec2(10, 14));
const vec2 EIGHT[8] =
    vec2[8](vec2(9, 5), vec2(7, 11), vec2(13, 9), vec2(5, 3), vec2(3, 13), vec2(1, 7), vec2(11, 15), vec2(15, 1));

vec2 sample_place(uint i) {
    return (SAMPLES == 8u ? EIGHT[i & 7u] : SAMPLES == 4u ? FOUR[i & 3u] : vec2(8.0)) / 16.0;
}

bool covered(uint i) {
    return (gl_SampleMaskIn[0] & (1 << int(i))) != 0;
}

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
    uint u = (in_axis + 1u) % 3u;
    uint v = (in_axis + 2u) % 3u;
    COUNT(CORNERS, 3u);
    vec3 a = triangles[in_triangle].corners[0];
    vec3 b = triangles[in_triangle].corners[1];
    vec3 c = triangles[in_triangle].corners[2];
    // The rasteriser snaps corners to a part of a pixel: a sample just outside of the triangle stays within its depth.
    float least = min(a[in_axis], min(b[in_axis], c[in_axis]));
    float most = max(a[in_axis], max(b[in_axis], c[in_axis]));
    // The dominant axis keeps both slopes at or below 1: samples of one pixel lie in three voxels at most.
    vec2 slope = vec2(in_normal[u], in_normal[v]) / in_normal[in_axis];
    vec2 pixel = floor(gl_FragCoord.xy);
    int slices[8];
    int first = 0x7fffffff;
    for (uint i = 0u; i < SAMPLES; i++) {
        float depth = a[in_axis] - dot(slope, pixel + sample_place(i) - vec2(a[u], a[v]));
        slices[i] = int(floor(clamp(depth, least, most)));
        first = covered(i) ? min(first, slices[i]) : first;
    }
    uvec3 counts = uvec3(0u);
    for (uint i = 0u; i < SAMPLES; i++) {
        int above = slices[i] - first;
        counts += covered(i) ? uvec3(above == 0, above == 1, above >= 2) : uvec3(0u);
    }
    for (int k = 0; k < 3; k++) {
        uvec3 voxel;
        voxel[u] = uint(pixel.x);
        voxel[v] = uint(pixel.y);
        voxel[in_axis] = uint(first + k);
        if (counts[k] > 0u && first + k >= 0 && first + k < int(EDGE)) {
            count_samples(voxel, counts[k]);
        }
    }
}
