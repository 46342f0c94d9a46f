#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with GATHERED
//! with AOVS
//! with MULTISAMPLED
// Image: shades the pixels of an opaque triangle while it is drawn, as the talk does.

layout(early_fragment_tests) in; // depth was drawn before

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // the first row that the band sees
} push;

const uint PARTS = 7u; // all

#include "ground/image/seen_by_samples.glsl"
#include "ground/image/shade.glsl"

layout(location = 0) out vec4 out_beauty;
#ifdef AOVS
layout(location = 1) out vec4 out_direct;
layout(location = 2) out vec4 out_indirect;
layout(location = 3) out vec4 out_normal;
layout(location = 4) out vec4 out_albedo;
layout(location = 5) out vec4 out_ao_depth_diffuse;
#endif

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

void main() {
    uvec2 at = uvec2(gl_FragCoord.xy);
    uint id = 1u + 2u * in_triangle + in_back;
    // The samples that see the triangle. llvmpipe's own mask lacks some at the border of a scissor.
    uint covered = 0u;
    for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
        covered |= seen_by(at, i) == id ? 1u << i : 0u;
    }
    uint needs = 0u;
    Shown shown = shade(in_triangle, in_back != 0u, at + uvec2(0u, push.first_seen), covered, true, needs);
    out_beauty = shown.beauty;
#ifdef AOVS
    out_direct = shown.direct;
    out_indirect = shown.indirect;
    out_normal = shown.normal;
    out_albedo = shown.albedo;
    out_ao_depth_diffuse = shown.ao_depth_diffuse;
#endif
}
