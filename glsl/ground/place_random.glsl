// Random numbers of places, which differ between the passes of a mean, so that the mean converges. A shader that lights
// list items defines LIGHTS_ITEMS before this file: its passes are those over the light, otherwise they are those over
// the image.

#include "common/jitter.glsl"
#include "ground/bindings.glsl"

uvec4 place_seed(vec3 position) {
    return uvec4(floatBitsToUint(position), 0u);
}

// The R2 sequence over passes (Roberts, 2018); 0 in the first one. A pass over the light gathers the light of earlier
// passes: with equal steps between passes, the light that a ray meets would correlate with its earlier direction.
// Therefore every 32 passes use the order of the triangular numbers, whose steps all differ.
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
