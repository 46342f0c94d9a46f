#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_post_depth_coverage : require
//! with PER_SAMPLE
// Lists the fragments of blended triangles that no opaque surface hides. With PER_SAMPLE every sample is a fragment: a
// device that lacks VK_EXT_post_depth_coverage cannot tell which samples of a pixel are hidden.

#define LISTS_FRAGMENTS
#include "common/count.glsl"
#include "ground/image/blended.glsl"
#include "ground/frame.glsl"

layout(early_fragment_tests) in;
#ifndef PER_SAMPLE
layout(post_depth_coverage) in;
#endif

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

layout(scalar) buffer GlobalsBuffer { Globals globals; };

layout(push_constant) uniform Push {
    uint first; // rows of those that the band sees
    uint end;
} push;

void main() {
#ifdef PER_SAMPLE
    uint covered = 1u << gl_SampleID;
#else
    uint covered = frame.samples == 1u ? 1u : uint(gl_SampleMaskIn[0]) & 15u;
#endif
    uint row = uint(gl_FragCoord.y);
    // No scissor cuts the rows: beside its border llvmpipe lists a pixel twice, with a half of its samples each.
    if (row < push.first || row >= push.end) {
        return;
    }
    uint slot = atomicAdd(blended_count.count, 1u);
    if (slot < uint(blended_links.length())) {
        if (slot % 64u == 0u) {
            atomicMax(blended_count.groups_x, min(slot / 64u + 1u, MOST_GROUPS));
        }
        COUNT(WORDS, 6u);
        uint place = row * uint(frame.image_size.x) + uint(gl_FragCoord.x);
        blended_fragments[slot] = fragment(uvec2(gl_FragCoord.xy), covered, 1u + 2u * in_triangle + in_back);
        blended_links[slot] = BlendedLink(atomicExchange(blended_heads[place], slot + 1u), gl_FragCoord.z);
    } else {
        atomicMax(globals.blended_fragments, slot + 1u);
    }
}
