#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Record: takes three vertices, appends one triangle record. Zero-area triangles are counted and dropped.

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

#include "ground/layout.glsl"
#include "ground/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/count.glsl"

layout(location = 0) in vec3 in_position[];
layout(location = 1) in vec3 in_normal[];
layout(location = 2) in vec4 in_tangent[];
layout(location = 3) in vec4 in_uv[];
layout(location = 4) in vec4 in_color[];

layout(push_constant, scalar) uniform Push {
    vec4 rows[3];
    vec3 normal_rows[3];
    uint material;
    uint first_source;
    uint mirrored;
    uint translucent;
} push;

layout(set = 0, binding = 1, scalar) buffer GlobalsBuffer { Globals globals; };
layout(set = 0, binding = 2, scalar) buffer Triangles { Triangle triangles[]; };
layout(set = 0, binding = 14, scalar) writeonly buffer Slots { uint slots[]; };

void main() {
    COUNT(SCENE_VERTICES, 3u);
    vec3 normal = triangle_normal(in_position[0], in_position[1], in_position[2]);
    if (normal == vec3(0.0)) {
        atomicAdd(globals.degenerate_count, 1u);
        return;
    }
    uint slot = atomicAdd(globals.vertex_count, 3u) / 3u;
    if (slot >= uint(triangles.length())) {
        atomicAdd(globals.triangle_overflow, 1u);
        return;
    }
    for (uint i = 0u; i < 3u; i++) {
        // A mirrored node turns the winding and the tangents' handedness around.
        uint k = push.mirrored != 0u ? 2u - i : i;
        triangles[slot].vertices[i].position = in_position[k];
        triangles[slot].vertices[i].normal = in_normal[k];
        triangles[slot].vertices[i].tangent = vec4(in_tangent[k].xyz, push.mirrored != 0u ? -in_tangent[k].w : in_tangent[k].w);
        triangles[slot].vertices[i].uv = in_uv[k];
        triangles[slot].vertices[i].color = uvec2(packHalf2x16(in_color[k].xy), packHalf2x16(in_color[k].zw));
    }
    triangles[slot].material = push.material;
    uint source = push.first_source + uint(gl_PrimitiveIDIn);
    triangles[slot].source = source;
    triangles[slot].translucent = push.translucent;
    if (source < uint(slots.length())) {
        slots[source] = slot + 1u; // rays find triangles by their source, and the image draws blended ones in an order of its own
    }
}
