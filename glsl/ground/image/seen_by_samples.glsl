// The visibility buffer: what every sample of the pixels sees that a band sees.
//! with MULTISAMPLED

#ifdef MULTISAMPLED
const uint PIXEL_SAMPLES = 4u;
uniform usampler2DMS seen;
#else
const uint PIXEL_SAMPLES = 1u;
uniform usampler2D seen;
#endif

// 0: nothing.
uint seen_by(uvec2 pixel, uint i) {
    return texelFetch(seen, ivec2(pixel), int(i)).r;
}
