#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Voxelise by samples: every vertex fetches its whole triangle from the buffer and projects its own corner along the
// axis that the triangle faces most, without a geometry shader.

#include "common/count.glsl"
#include "common/dominant_axis.glsl"
#include "common/triangle_box.glsl"
#include "ground/constants.glsl"
#include "ground/layout.glsl"

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };

#include "ground/grid_push.glsl"

layout(location = 0) flat out uint out_triangle;
layout(location = 1) flat out uint out_axis;
layout(location = 2) flat out vec3 out_normal;

void main() {
    COUNT(CORNERS, 3u);
    // The count of the draw is the recorder's counter, which may exceed the buffer.
    out_triangle = min(uint(gl_VertexIndex) / 3u, uint(triangles.length()) - 1u);
    vec3 a = in_grid(triangles[out_triangle].corners[0]);
    vec3 b = in_grid(triangles[out_triangle].corners[1]);
    vec3 c = in_grid(triangles[out_triangle].corners[2]);
    out_normal = triangle_normal(a, b, c);
    out_axis = dominant_axis(out_normal);
    uint corner = uint(gl_VertexIndex) % 3u;
    vec3 own = corner == 0u ? a : corner == 1u ? b : c;
    vec2 pixel = across(own, out_axis);
    gl_Position = vec4(pixel * (2.0 / float(EDGE)) - 1.0, 0.5, 1.0);
}
