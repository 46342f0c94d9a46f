// The fragments of blended surfaces; those of a pixel are contiguous, back to front.

#include "ground/image/fragments.glsl"

layout(scalar) readonly buffer BlendedFragments {
    ListCount blended_counts[COUNTS];
    Fragment blended_fragments[];
};
// For each pixel that a band sees: the start and the number of its fragments.
layout(scalar) readonly buffer BlendedOfPixels { uvec2 blended_of_pixels[]; };
