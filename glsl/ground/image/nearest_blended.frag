#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MULTISAMPLED
// The nearest blended triangle of every sample that no opaque surface hides: light is gathered for it.

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

layout(location = 0) out uint out_seen; // as visibility.frag writes it

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // the first row that the band sees
} push;

#include "ground/image/holes.glsl"

#ifdef MULTISAMPLED
uniform sampler2DMS opaque_depth;
#else
uniform sampler2D opaque_depth;
#endif

void main() {
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    bool hidden = texelFetch(opaque_depth, ivec2(pixel), gl_SampleID).r > gl_FragCoord.z;
    COUNT(TRIANGLES, 1u);
    if (hidden || unmasked(triangles[in_triangle], attributes_of(in_triangle), pixel, 1u << uint(gl_SampleID)) == 0u) {
        COUNT_ALL();
        discard;
    }
    out_seen = 1u + 2u * in_triangle + in_back;
}
