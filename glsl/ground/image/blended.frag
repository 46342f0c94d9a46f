#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Lists the samples that see a blended triangle, if no opaque surface hides it and its alpha is not 0. Each sample runs
// separately, because on llvmpipe the mask of a pixel's samples lacks some at the border of a scissor, and includes
// hidden ones without an extension.

#define WRITES_GLOBALS
#include "common/count.glsl"
#include "ground/frame.glsl"
#include "ground/image/blended_samples.glsl"
#include "ground/layout.glsl"

layout(early_fragment_tests) in;

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // the first row that the band sees
} push;

#include "ground/image/holes.glsl"

void main() {
    uint own = 1u << uint(gl_SampleID);
    COUNT(TRIANGLES, 1u);
    if (unmasked(triangles[in_triangle], attributes_of(in_triangle), uvec2(gl_FragCoord.xy), own) == 0u) {
        COUNT_ALL();
        discard;
    }
    uint slot = atomicAdd(blended_sample_count, 1u);
    if (slot < uint(blended_samples.length())) {
        COUNT(WORDS, 5u);
        uint place = uint(gl_FragCoord.y) * uint(frame.image_size.x) + uint(gl_FragCoord.x);
        uint next = atomicExchange(blended_heads[place], slot + 1u);
        blended_samples[slot] = BlendedSample(next, 1u + 2u * in_triangle + in_back, own, gl_FragCoord.z);
    } else {
        atomicMax(globals.blended_samples, slot + 1u);
    }
}
