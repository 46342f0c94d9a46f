// The fragments of blended triangles, a linked list per pixel. The shader that lists them defines LISTS_FRAGMENTS.
//! with LISTS_FRAGMENTS

#include "ground/image/fragments.glsl"

struct BlendedLink {
    uint next; // 1-based; 0 ends the list
    float depth; // 0: infinitely far
};

layout(scalar) FRAGMENTS_ACCESS buffer BlendedFragments {
    ListCount blended_count; // may be more than there is room for
    Fragment blended_fragments[];
};
layout(scalar) buffer BlendedLinks { BlendedLink blended_links[]; };
layout(scalar) FRAGMENTS_ACCESS buffer BlendedHeads { uint blended_heads[]; }; // per pixel that a band sees; as `next`
