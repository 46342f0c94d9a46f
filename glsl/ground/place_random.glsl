// Random numbers of places: others in every pass whose mean is taken, so that the mean converges. A shader that lights
// list items defines LIGHTS_ITEMS before this file: its passes are those over the voxels, all others' are those over
// the image.

#include "common/jitter.glsl"
#include "ground/bindings.glsl"

uvec4 place_seed(vec3 position) {
    return uvec4(floatBitsToUint(position), 0u);
}

// The R2 sequence over passes (Roberts, 2018); 0 in the first. A pass over the voxels gathers what passes before it
// left: with the same step from each to the next, what light meets would depend on where it was sent before. So every
// 32 passes take their places in the order of the triangular numbers, whose steps all differ.
vec2 pass_shift() {
#ifdef LIGHTS_ITEMS
    uint k = frame.light_pass % 32u;
    uint place = frame.light_pass - k + (k * (k + 1u) / 2u) % 32u;
    return fract(float(place) * vec2(0.7548776662, 0.5698402909));
#else
    return frame.image_shift;
#endif
}

vec2 place_random(vec3 position) {
    uvec4 seed = place_seed(position);
    return fract(vec2(jitter_hash(seed), jitter_hash(seed.wzyx ^ 0x9e3779b9u)) + pass_shift());
}
