#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_post_depth_coverage : require
//! per method
//! with GATHERED except none
//! with AOVS
// Image: shades a triangle's pixels as they are drawn; blended ones go over what lies behind them.

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
} push;

#include "ground/image/shade.glsl"

layout(early_fragment_tests) in; // depth is there already
// A sample that a nearer surface hides may lie beyond a wall; left out where a device lacks it.
layout(post_depth_coverage) in;

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

void main() {
    uint covered = frame.samples == 1u ? 1u : uint(gl_SampleMaskIn[0]) & 15u;
    uvec2 pixel = uvec2(gl_FragCoord.xy) + uvec2(0u, push.first_row);
    write(shade(in_triangle, in_back != 0u, pixel, covered));
}
