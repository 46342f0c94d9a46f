#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method
//! with GATHERED except none
//! with AOVS
//! with ASKS only rays
// Image: shades listed fragments. A thread per fragment. With ASKS it requests the light of list items instead.

#include "common/spread.glsl"
#include "ground/image/fragments.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // of the image, the first row that the band sees
} push;

#include "ground/image/shade.glsl"

layout(local_size_x = 64) in;

#ifdef AOVS
layout(rgba32f) writeonly uniform image2D shaded[6];
#else
layout(rgba32f) writeonly uniform image2D shaded[1];
#endif

void main() {
    uint count = min(fragment_count.count, uint(fragments.length()));
    uint block = block_at(gl_WorkGroupID.x, (count + 63u) / 64u);
    // Threads beyond the last fragment repeat its work: llvmpipe takes a third longer if main has a branch.
    uint slot = min(block * 64u + gl_LocalInvocationID.x, count - 1u);
    COUNT(WORDS, 3u);
    Fragment f = fragments[slot];
    uvec2 pixel = place_of(f) + uvec2(0u, push.first_seen);
    uint seen = seen_of(f);
    Shown shown = shade((seen - 1u) / 2u, (seen & 1u) == 0u, pixel, samples_of(f), (f.seen & BEHIND) == 0u);
#ifndef ASKS
    ivec2 at = fragment_texel(slot, imageSize(shaded[0]).x);
    imageStore(shaded[0], at, shown.beauty);
#ifdef AOVS
    imageStore(shaded[1], at, shown.direct);
    imageStore(shaded[2], at, shown.indirect);
    imageStore(shaded[3], at, shown.normal);
    imageStore(shaded[4], at, shown.albedo);
    imageStore(shaded[5], at, shown.ao_depth_diffuse);
#endif
#endif
}
