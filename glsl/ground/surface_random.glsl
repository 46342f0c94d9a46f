// Random numbers of the surface that an invocation lights: others in every pass whose mean is taken, so that the mean
// converges. A shader that lights list items defines LIGHTS_ITEMS before this file: its passes are those over the
// voxels, all others' are those over the image.

#include "common/jitter.glsl"
#include "ground/bindings.glsl"

// An invocation sets this before it lights a surface. Integers, because drivers round positions differently: of an item
// its voxel, of an image its pixel, and the material. The triangle's number would change with the order of triangles.
uvec4 random_seed = uvec4(0u);

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

vec2 surface_random() {
    return fract(vec2(jitter_hash(random_seed), jitter_hash(random_seed.wzyx ^ 0x9e3779b9u)) + pass_shift());
}
