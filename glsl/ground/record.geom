#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Record: takes three vertices, appends one triangle record. Zero-area triangles are counted and dropped.

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

#include "ground/attributes.glsl"
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

layout(scalar) buffer GlobalsBuffer { Globals globals; };
layout(scalar) buffer Triangles { Triangle triangles[]; };
layout(scalar) writeonly buffer AttributeWords { uint attribute_words[]; };
layout(scalar) writeonly buffer Slots { uint slots[]; };

void write_word(inout uint place, float value) {
    attribute_words[place++] = floatBitsToUint(value);
}

void write_attributes(uint place, vec3 normal, vec4 tangent, vec4 uv, vec4 color) {
    for (int k = 0; k < 3; k++) {
        write_word(place, normal[k]);
    }
    for (int k = 0; k < int(tangent_words()); k++) {
        write_word(place, tangent[k]);
    }
    for (int k = 0; k < int(uv_words()); k++) {
        write_word(place, uv[k]);
    }
    if (color_words() > 0u) {
        attribute_words[place] = packHalf2x16(color.xy);
        attribute_words[place + 1u] = packHalf2x16(color.zw);
    }
}

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
        triangles[slot].corners[i] = in_position[k];
        vec4 tangent = vec4(in_tangent[k].xyz, push.mirrored != 0u ? -in_tangent[k].w : in_tangent[k].w);
        write_attributes(corner_place(slot, i), in_normal[k], tangent, in_uv[k], in_color[k]);
    }
    triangles[slot].material = push.material;
    uint source = push.first_source + uint(gl_PrimitiveIDIn);
    triangles[slot].source = source;
    triangles[slot].translucent = push.translucent;
    if (source < uint(slots.length())) {
        // Rays find triangles by their source, and the image draws blended ones in an order of its own.
        slots[source] = slot + 1u;
    }
}
