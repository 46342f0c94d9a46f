// The triangles that are seen in a pixel, an entry each: listed apart from where it lies in the image, so that one
// fragment is shaded beside another however small triangles are. The pass that lists them defines LISTS_FRAGMENTS.
//! with LISTS_FRAGMENTS

struct Fragment {
    uint place; // of the pixel in its band, row by row; above, the samples that see the triangle
    uint seen; // as in the visibility buffer
};

const uint PLACE_BITS = 28u;
const uint COUNT_BITS = 3u;

#ifdef LISTS_FRAGMENTS
#define FRAGMENTS_ACCESS
#else
#define FRAGMENTS_ACCESS readonly

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint width; // of the image, and of a row of shaded fragments
    uint rows; // of these, at most
} push;
#endif

layout(scalar) FRAGMENTS_ACCESS buffer Fragments {
    uint fragment_count;
    Fragment fragments[];
};
// Per pixel of the band: where its fragments begin, and below that how many there are.
layout(scalar) FRAGMENTS_ACCESS buffer PixelFragments { uint pixel_fragments[]; };
