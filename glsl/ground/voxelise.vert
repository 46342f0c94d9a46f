#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Voxelise: fetches corners from the triangle buffer.

#include "ground/layout.glsl"
#include "common/count.glsl"

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };

#include "ground/grid_push.glsl"

layout(location = 0) out vec3 out_position;
layout(location = 1) flat out uint out_triangle;

void main() {
    COUNT(CORNERS, 1u);
    // The count of the draw is the recorder's counter, which may exceed the buffer.
    out_triangle = min(uint(gl_VertexIndex) / 3u, uint(triangles.length()) - 1u);
    out_position = in_grid(triangles[out_triangle].corners[uint(gl_VertexIndex) % 3u]);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
