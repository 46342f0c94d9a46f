#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method
//! with GATHERED except none
//! with AOVS
// Image: shades listed fragments. A thread per fragment.

#include "ground/image/fragments.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint rows; // of the band
    uint first_seen; // of the image, the first row that the band sees
    uint width; // of the image
    uint first; // of the fragments, in 1/FRAGMENT_SHARES
    uint end;
} push;

#include "ground/image/shade.glsl"

layout(local_size_x = 64) in;

const uint FRAGMENT_SHARES = 1024u;

#ifdef AOVS
layout(rgba32f) writeonly uniform image2D shaded[6];
#else
layout(rgba32f) writeonly uniform image2D shaded[1];
#endif

void main() {
    uint count = min(fragment_count.count, uint(fragments.length()));
    uint share = (count + FRAGMENT_SHARES - 1u) / FRAGMENT_SHARES;
    uint end = min(push.end * share, count);
    for (uint slot = push.first * share + gl_GlobalInvocationID.x; slot < end; slot += gl_NumWorkGroups.x * 64u) {
        COUNT(WORDS, 3u);
        Fragment f = fragments[slot];
        uint place = pixel_of(f);
        uvec2 pixel = uvec2(place % push.width, push.first_seen + place / push.width);
        if (pixel.y - push.first_row < push.rows) { // others are there for what is gathered
            Shown shown = shade((f.seen - 1u) / 2u, (f.seen & 1u) == 0u, pixel, samples_of(f));
            ivec2 at = fragment_texel(slot);
            imageStore(shaded[0], at, shown.beauty);
#ifdef AOVS
            imageStore(shaded[1], at, shown.direct);
            imageStore(shaded[2], at, shown.indirect);
            imageStore(shaded[3], at, shown.normal);
            imageStore(shaded[4], at, shown.albedo);
            imageStore(shaded[5], at, shown.ao_depth_diffuse);
#endif
        }
    }
}
