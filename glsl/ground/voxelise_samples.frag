#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Voxelise by samples: every voxel with samples of the triangle lists it, with the number of its samples. CPU twin:
// tests/twins/cover.rs.

#include "common/count.glsl"
#include "ground/layout.glsl"
#include "ground/list_append.glsl"
#include "ground/samples.glsl"

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_axis;
layout(location = 2) flat in vec3 in_normal;

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) buffer ItemSamples { uint item_samples[]; };

void main() {
    COUNT(CORNERS, 3u);
    vec3 a = in_grid(triangles[in_triangle].corners[0]);
    vec3 b = in_grid(triangles[in_triangle].corners[1]);
    vec3 c = in_grid(triangles[in_triangle].corners[2]);
    Slices slices = slices_of(a, b, c, in_axis, in_normal);
    for (int k = 0; k < 3; k++) {
        uvec3 voxel;
        if (voxel_of(slices, k, in_axis, voxel) && !in_hole(voxel)) {
            uint item = take_items(1u);
            if (put(item, in_triangle, voxel)) {
                item_samples[item - 1u] = slices.counts[k];
            }
        }
    }
}
