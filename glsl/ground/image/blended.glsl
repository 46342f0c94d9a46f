// The fragments of blended surfaces: those of a pixel stand side by side, back to front.

#include "ground/image/fragments.glsl"

layout(scalar) readonly buffer BlendedFragments {
    ListCount blended_count;
    Fragment blended_fragments[];
};
// Per pixel that a band sees: where its fragments begin, and how many there are.
layout(scalar) readonly buffer BlendedOfPixels { uvec2 blended_of_pixels[]; };
