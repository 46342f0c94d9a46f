#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Record, as in the talk: takes three vertices, and appends one triangle record. Zero-area triangles are counted and
// dropped.

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

#define DRAWN
#include "ground/recorded.glsl"

layout(location = 0) in vec3 in_position[];
layout(location = 1) in vec3 in_normal[];
layout(location = 2) in vec4 in_tangent[];
layout(location = 3) in vec4 in_uv[];
layout(location = 4) in vec4 in_color[];

void main() {
    COUNT(SCENE_VERTICES, 3u);
    if (triangle_normal(in_position[0], in_position[1], in_position[2]) == vec3(0.0)) {
        atomicAdd(globals.degenerate_count, 1u);
        return;
    }
    uint slot = take_slot();
    if (slot >= uint(triangles.length())) {
        return;
    }
    for (uint i = 0u; i < 3u; i++) {
        uint k = corner_number(i);
        write_corner(slot, i, Corner(in_position[k], in_normal[k], in_tangent[k], in_uv[k], in_color[k]));
    }
    write_triangle(slot, uint(gl_PrimitiveIDIn));
}
