#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with DILATED
// Voxelise, as in the talk: a pixel is a column of voxels. Every voxel of the column that the triangle touches lists
// it; with DILATED, every voxel that the dilated triangle touches.

#include "common/count.glsl"
#include "ground/layout.glsl"
#include "ground/list_column.glsl"

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_axis;
layout(location = 2) flat in vec3 in_normal;
#ifdef DILATED
layout(location = 3) flat in vec3 in_dilated[4];
#endif

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };

void main() {
#ifdef DILATED
    Projected p = Projected(in_dilated[0], in_dilated[1], in_dilated[2], in_dilated[3], in_normal, in_axis);
#else
    COUNT(CORNERS, 3u);
    vec3 a = in_grid(triangles[in_triangle].corners[0]);
    vec3 b = in_grid(triangles[in_triangle].corners[1]);
    vec3 c = in_grid(triangles[in_triangle].corners[2]);
    Projected p = Projected(a, b, c, in_normal, in_axis);
#endif
    uvec2 column = uvec2(gl_FragCoord.xy);
    uint touched = touched_in(p, column);
    if (touched != 0u) {
        list_column(in_triangle, p, column, touched, take_items(uint(bitCount(touched))));
    }
}
