#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with AOVS
//! with DRAWN
//! with MULTISAMPLED
//! with BLENDS
// Resolve: every sample of a pixel shows the sky or the opaque surface in front of it, and over these the blended
// surfaces, back to front; the pixel shows the mean of its samples. A thread per pixel. Opaque surfaces come from the
// list of fragments or, with DRAWN, from images into which they were drawn, with MULTISAMPLED of four samples. With
// BLENDS some surface is blended.

#include "common/count.glsl"
#include "ground/sky.glsl"
#include "ground/image/fragments.glsl"
#include "ground/image/seen_by_samples.glsl"
#include "ground/image/view_way.glsl"
#ifdef BLENDS
#include "ground/image/blended.glsl"
#endif

layout(local_size_x = 64) in;

#ifdef AOVS
const uint OUTPUTS = 6u;
#else
const uint OUTPUTS = 1u;
#endif

layout(rgba32f) writeonly uniform image2D resolved[OUTPUTS];
#ifdef DRAWN
#ifdef MULTISAMPLED
uniform sampler2DMS shaded[OUTPUTS];
#else
uniform sampler2D shaded[OUTPUTS];
#endif
#else
uniform sampler2D shaded[OUTPUTS]; // of every fragment
#endif
#ifdef BLENDS
uniform sampler2D shaded_blended[OUTPUTS];
#endif

layout(push_constant) uniform Push {
    vec3 sky; // radiance of a uniform sky
    uint varied_sky;
    uint first_seen; // the first row of the image that this band sees
    uint first; // relative to those rows
} push;

const float FAR = 1e36; // as in src/ground/image/target.rs

// The outputs of a sample: radiance and further layers, each premultiplied by opacity, and opacity.
struct Colors {
    vec4 of[OUTPUTS];
};

// One texel of each image of an array.
#ifdef AOVS
#define COLORS(images, at, i) \
    Colors(vec4[OUTPUTS](texelFetch(images[0], at, i), texelFetch(images[1], at, i), texelFetch(images[2], at, i), \
        texelFetch(images[3], at, i), texelFetch(images[4], at, i), texelFetch(images[5], at, i)))
#else
#define COLORS(images, at, i) Colors(vec4[OUTPUTS](texelFetch(images[0], at, i)))
#endif

// The outputs of a pixel without a surface.
Colors behind(uvec2 pixel) {
    vec3 sky = push.sky;
    if (push.varied_sky != 0u) {
        vec3 across = off_axis(vec2(pixel) + 0.5);
        sky = sky_towards(normalize(frame.orthographic != 0u ? frame.forward : frame.forward + across)) / frame.scale;
    }
    Colors colors;
    colors.of[0] = vec4(sky, 0.0);
#ifdef AOVS
    colors.of[1] = vec4(sky, 0.0);
    colors.of[2] = vec4(0.0);
    colors.of[3] = vec4(0.0);
    colors.of[4] = vec4(0.0);
    colors.of[5] = vec4(1.0, FAR, 0.0, 0.0);
#endif
    return colors;
}

void main() {
    uint width = uint(frame.image_size.x);
    // Threads beyond the last column repeat its work.
    uvec2 at = uvec2(min(gl_GlobalInvocationID.x, width - 1u), push.first + gl_GlobalInvocationID.y);
    uint place = at.y * width + at.x;
    uvec2 pixel = at + uvec2(0u, push.first_seen);
    Colors sky = behind(pixel);
    Colors samples[PIXEL_SAMPLES];
    for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
        samples[i] = sky;
    }
#ifdef DRAWN
    for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
        if (seen_by(at, i) != 0u) {
            samples[i] = COLORS(shaded, ivec2(at), int(i));
        }
    }
#else
    COUNT(WORDS, 1u);
    uint of_pixel = pixel_fragments[place];
    uint first = of_pixel >> COUNT_BITS;
    for (uint slot = first; slot < first + (of_pixel & (1u << COUNT_BITS) - 1u); slot++) {
        COUNT(WORDS, 1u);
        uint covered = PIXEL_SAMPLES == 1u ? 1u : samples_of(fragments[slot]);
        Colors colors = COLORS(shaded, fragment_texel(slot, textureSize(shaded[0], 0).x), 0);
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            if ((covered & 1u << i) != 0u) {
                samples[i] = colors;
            }
        }
    }
#endif
#ifdef BLENDS
    COUNT(WORDS, 2u);
    uvec2 blended = blended_of_pixels[place];
    for (uint slot = blended.x; slot < blended.x + blended.y; slot++) {
        COUNT(WORDS, 2u);
        uint covered = samples_of(blended_fragments[slot]);
        Colors over = COLORS(shaded_blended, fragment_texel(slot, textureSize(shaded_blended[0], 0).x), 0);
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            float seen = (covered & 1u << i) != 0u ? 1.0 : 0.0;
            for (uint o = 0u; o < OUTPUTS; o++) {
                samples[i].of[o] = seen * over.of[o] + samples[i].of[o] * (1.0 - seen * over.of[o].a);
            }
        }
    }
#endif
    Colors mean;
    for (uint k = 0u; k < OUTPUTS; k++) {
        vec4 sum = samples[0].of[k];
        for (uint i = 1u; i < PIXEL_SAMPLES; i++) {
            sum += samples[i].of[k];
        }
        mean.of[k] = sum / float(PIXEL_SAMPLES);
    }
    imageStore(resolved[0], ivec2(pixel), mean.of[0]);
#ifdef AOVS
    imageStore(resolved[1], ivec2(pixel), mean.of[1]);
    imageStore(resolved[2], ivec2(pixel), mean.of[2]);
    imageStore(resolved[3], ivec2(pixel), mean.of[3]);
    imageStore(resolved[4], ivec2(pixel), mean.of[4]);
    imageStore(resolved[5], ivec2(pixel), mean.of[5]);
#endif
}
