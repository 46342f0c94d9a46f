#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The image's depth where alpha masks leave holes, sample by sample.

#include "ground/constants.glsl"
#include "ground/surface.glsl"

layout(push_constant) uniform Push {
    uint first_row;
} push;

#include "ground/image/mask.glsl"

layout(location = 0) in vec3 in_weights;
layout(location = 2) flat in uint in_triangle;

void main() {
    Triangle t = triangles[in_triangle];
    Attributes attributes = attributes_of(in_triangle);
    COUNT(TRIANGLES, 1u);
    uint covered = covered_samples(t, attributes, pixel_footprint(attributes, in_weights));
    if (covered == 0u) {
        COUNT_ALL();
        discard;
    }
    gl_SampleMask[0] = int(covered);
}
