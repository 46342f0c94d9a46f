// Directions that differ within squares of INTERLEAVE pixels.

#include "ground/constants.glsl"

// Each pixel of a square (or each voxel in any plane through a cube) has its own shift; the shifts are spread evenly
// over the unit square: Hammersley's points.
vec2 interleaved_shift(uvec3 at) {
    const uint count = INTERLEAVE * INTERLEAVE;
    uint k = (at.x + at.z) % INTERLEAVE + INTERLEAVE * ((at.y + at.z) % INTERLEAVE);
    float reversed = float(bitfieldReverse(k)) / 4294967296.0;
    return vec2((float(k) + 0.5) / float(count), reversed);
}
