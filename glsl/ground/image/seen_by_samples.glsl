// The visibility buffer: the triangle of every sample in the pixels that a band sees.
//! with MULTISAMPLED

#ifdef MULTISAMPLED
const uint PIXEL_SAMPLES = 4u;
uniform usampler2DMS seen;
#else
const uint PIXEL_SAMPLES = 1u;
uniform usampler2D seen;
#endif

// 0: no triangle.
uint seen_by(uvec2 pixel, uint i) {
    return texelFetch(seen, ivec2(pixel), int(i)).r;
}
