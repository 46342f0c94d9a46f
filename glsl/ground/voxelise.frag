#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with DILATED
// Voxelise: a pixel is a column of voxels. Every voxel of the column that the triangle touches gets it into its list;
// with DILATED, that the dilated triangle touches.

#include "ground/layout.glsl"
#include "ground/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/count.glsl"

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_axis;
layout(location = 2) flat in vec3 in_normal;
#ifdef DILATED
layout(location = 3) flat in vec3 in_dilated[4];
#endif

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };

#include "ground/list_append.glsl"

void main() {
#ifdef DILATED
    vec3 a = in_dilated[0];
    vec3 b = in_dilated[1];
    vec3 c = in_dilated[2];
    vec3 d = in_dilated[3];
#else
    COUNT(CORNERS, 3u);
    vec3 a = in_grid(triangles[in_triangle].corners[0]);
    vec3 b = in_grid(triangles[in_triangle].corners[1]);
    vec3 c = in_grid(triangles[in_triangle].corners[2]);
    vec3 d = c;
#endif
    uint u = (in_axis + 1u) % 3u;
    uint v = (in_axis + 2u) % 3u;
    vec2 pixel = floor(gl_FragCoord.xy);
    vec2 middle = pixel + 0.5;

    // Where the plane crosses the column, within the triangle's own depth. The dominant axis keeps the slope below 1.
    float depth_low = min(min(a[in_axis], b[in_axis]), min(c[in_axis], d[in_axis]));
    float depth_high = max(max(a[in_axis], b[in_axis]), max(c[in_axis], d[in_axis]));
    vec2 slope = vec2(in_normal[u], in_normal[v]) / in_normal[in_axis];
    float depth = a[in_axis] - dot(slope, middle - vec2(a[u], a[v]));
    // A hundredth of a voxel for rounding: the exact test follows.
    float spread = 0.5 * (abs(slope.x) + abs(slope.y)) + 0.01;
    float last = float(EDGE) - 1.0;
    int first = int(clamp(floor(max(depth_low, depth - spread) - 0.001), 0.0, last));
    int end = int(clamp(floor(min(depth_high, depth + spread) + 0.001), 0.0, last));
    for (int k = first; k <= end; k++) {
        uvec3 voxel;
        voxel[u] = uint(pixel.x);
        voxel[v] = uint(pixel.y);
        voxel[in_axis] = uint(k);
        bool touches = triangle_touches_voxel(a, b, c, in_normal, vec3(voxel) + 0.5);
#ifdef DILATED
        touches = touches || triangle_touches_voxel(b, c, d, in_normal, vec3(voxel) + 0.5);
#endif
        if (touches && !in_hole(voxel)) {
            append(in_triangle, voxel);
        }
    }
}
