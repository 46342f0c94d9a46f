#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Image: fetches corners from the triangle buffer. A single-sided triangle seen from behind is not drawn.

#include "ground/layout.glsl"
#include "ground/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/count.glsl"

#include "ground/frame.glsl"
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer Materials { Material materials[]; };
layout(scalar) readonly buffer Slots { uint slots[]; }; // source → 1 + place in the buffer
layout(scalar) readonly buffer BlendedSources { uint blended_sources[]; };

layout(location = 0) flat out uint out_triangle;
layout(location = 1) flat out uint out_back;

invariant gl_Position;

void main() {
    COUNT(CORNERS, 3u);
    uint corner = uint(gl_VertexIndex) % 3u;
    uint place = uint(gl_VertexIndex) / 3u;
    if (BLENDED != 0u) {
        place = slots[blended_sources[place]] - 1u; // ~0 if the triangle was dropped
    }
    out_triangle = min(place, uint(triangles.length()) - 1u);
    vec3 a = triangles[out_triangle].corners[0];
    vec3 normal = triangle_normal(a, triangles[out_triangle].corners[1], triangles[out_triangle].corners[2]);
    float facing = dot(normal, frame.orthographic != 0u ? -frame.forward : frame.eye - a);
    out_back = facing < 0.0 ? 1u : 0u;
    uint flags = materials[triangles[out_triangle].material].flags;
    bool hidden = place >= uint(triangles.length()) || (out_back != 0u && (flags & MATERIAL_DOUBLE_SIDED) == 0u)
        || ((flags & MATERIAL_BLEND) != 0u) != (BLENDED != 0u);
    gl_Position =
        hidden ? vec4(0.0, 0.0, 0.0, 1.0) : frame.clip_from_voxel * vec4(triangles[out_triangle].corners[corner], 1.0);
}
