#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 2a/4a, voxelise: fetches from the triangle buffer.

#include "common/layout.glsl"
#include "common/count.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer FrameBuffer { Frame frame; };
layout(set = 0, binding = 2, scalar) readonly buffer Triangles { Triangle triangles[]; };

layout(location = 0) out vec3 out_position;
layout(location = 1) flat out uint out_triangle;

void main() {
    COUNT(CORNERS, 1u);
    // The draw's count is the recorder's counter, which runs on past a full buffer.
    out_triangle = min(uint(gl_VertexIndex) / 3u, frame.triangle_capacity - 1u);
    out_position = triangles[out_triangle].vertices[uint(gl_VertexIndex) % 3u].position;
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
