#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The depth of gathered pixels where alpha masks leave holes.

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/image/footprint.glsl"

layout(location = 0) in vec3 in_weights;
layout(location = 2) flat in uint in_triangle;

void main() {
    Triangle t = triangles[in_triangle];
    COUNT(TRIANGLES, 1u);
    Material m = materials[t.material];
    float alpha = base_color(m, triangle_uv(t, in_weights), triangle_color(t, in_weights), pixel_footprint(t, in_weights)).a;
    if (surface_alpha(m, alpha) <= 0.0) {
        COUNT_ALL();
        discard;
    }
}
