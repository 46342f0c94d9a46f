// Random numbers of places: others in every pass whose mean is taken, so that the mean converges. A shader that lights list items
// defines LIGHTS_ITEMS before this file: its passes are those over the voxels, all others' are those over the image.

#include "common/jitter.glsl"
#include "ground/bindings.glsl"

uvec4 place_seed(vec3 position) {
    return uvec4(floatBitsToUint(position), 0u);
}

// The R2 sequence over passes (Roberts, 2018); 0 in the first.
vec2 pass_shift() {
#ifdef LIGHTS_ITEMS
    return fract(float(frame.light_pass) * vec2(0.7548776662, 0.5698402909));
#else
    return frame.image_shift;
#endif
}

vec2 place_random(vec3 position) {
    uvec4 seed = place_seed(position);
    return fract(vec2(jitter_hash(seed), jitter_hash(seed.wzyx ^ 0x9e3779b9u)) + pass_shift());
}
