// The fragments of blended surfaces, sorted: those of a pixel stand side by side, back to front. The shader that lists
// them defines LISTS_FRAGMENTS.
//! with LISTS_FRAGMENTS

#include "ground/image/fragments.glsl"

layout(scalar) FRAGMENTS_ACCESS buffer BlendedFragments {
    ListCount blended_count;
    Fragment blended_fragments[];
};
// Per pixel that a band sees: where its fragments begin, and how many there are.
layout(scalar) FRAGMENTS_ACCESS buffer BlendedOfPixels { uvec2 blended_of_pixels[]; };
