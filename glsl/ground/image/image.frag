#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method
//! with GATHERED except none
//! with AOVS
// Image: shades the listed fragments of some rows, packed one beside the other; the pass spread puts them where they
// are seen.

#include "ground/image/fragments.glsl"

#include "ground/image/shade.glsl"

void main() {
    uint slot = uint(gl_FragCoord.y) * push.width + uint(gl_FragCoord.x);
    Fragment f = fragments[min(slot, fragment_count - 1u)]; // the last row may be longer than the list
    COUNT(WORDS, 3u);
    uint place = f.place & (1u << PLACE_BITS) - 1u;
    uvec2 pixel = uvec2(place % push.width, push.first_row + place / push.width);
    write(shade((f.seen - 1u) / 2u, (f.seen & 1u) == 0u, pixel, f.place >> PLACE_BITS));
}
