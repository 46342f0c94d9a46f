#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Lists the samples that see a blended triangle which no opaque surface hides. Each sample runs by itself: the mask of
// a pixel's samples lacks some on llvmpipe beside the border of a scissor, and has hidden ones without an extension.

#include "common/count.glsl"
#include "ground/frame.glsl"
#include "ground/image/blended_samples.glsl"
#include "ground/layout.glsl"

layout(early_fragment_tests) in;

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

layout(scalar) buffer GlobalsBuffer { Globals globals; };

void main() {
    uint slot = atomicAdd(blended_sample_count, 1u);
    if (slot < uint(blended_samples.length())) {
        COUNT(WORDS, 5u);
        uint place = uint(gl_FragCoord.y) * uint(frame.image_size.x) + uint(gl_FragCoord.x);
        uint next = atomicExchange(blended_heads[place], slot + 1u);
        blended_samples[slot] = BlendedSample(next, 1u + 2u * in_triangle + in_back, 1u << gl_SampleID, gl_FragCoord.z);
    } else {
        atomicMax(globals.blended_samples, slot + 1u);
    }
}
