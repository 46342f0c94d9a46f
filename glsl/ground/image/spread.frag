#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with AOVS
// Spread: what was shaded for a fragment goes to the samples that see it.

#include "common/count.glsl"

#include "ground/image/fragments.glsl"
#include "ground/image/outputs.glsl"

#ifdef AOVS
uniform sampler2D shaded[6];
#else
uniform sampler2D shaded[1];
#endif

layout(location = 0) flat in uint in_instance; // which of the pixel's fragments

void main() {
    COUNT(WORDS, 1u);
    uint of_pixel = pixel_fragments[uint(gl_FragCoord.y) * push.width + uint(gl_FragCoord.x)];
    if (in_instance >= (of_pixel & (1u << COUNT_BITS) - 1u)) {
        COUNT_ALL();
        discard;
    }
    uint slot = (of_pixel >> COUNT_BITS) + in_instance;
    COUNT(WORDS, 1u);
    gl_SampleMask[0] = int(fragments[slot].place >> PLACE_BITS);
    ivec2 at = ivec2(slot % push.width, slot / push.width);
    out_beauty = texelFetch(shaded[0], at, 0);
#ifdef AOVS
    out_direct = texelFetch(shaded[1], at, 0);
    out_indirect = texelFetch(shaded[2], at, 0);
    out_normal = texelFetch(shaded[3], at, 0);
    out_albedo = texelFetch(shaded[4], at, 0);
    out_ao_depth_diffuse = texelFetch(shaded[5], at, 0);
#endif
}
