#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The depth of gathered pixels where alpha masks leave holes.

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/image/footprint.glsl"

layout(location = 0) in vec3 in_weights;
layout(location = 1) flat in uint in_triangle;

void main() {
    Attributes attributes = attributes_of(in_triangle);
    COUNT(TRIANGLES, 1u);
    Material m = materials[triangles[in_triangle].material];
    vec4 uv = between(attributes.uvs, in_weights);
    float alpha = base_color(m, uv, between(attributes.colors, in_weights), pixel_footprint(attributes, in_weights)).a;
    if (surface_alpha(m, alpha) <= 0.0) {
        COUNT_ALL();
        discard;
    }
}
