#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MASKED
// Which triangle every sample of the image sees: a visibility buffer (Burns and Hunt, JCGT 2013). With MASKED, alpha masks leave holes.

layout(location = 0) in vec3 in_weights;
layout(location = 1) flat in uint in_triangle;
layout(location = 2) flat in uint in_back;

layout(location = 0) out uint out_seen; // 1 + 2 × the triangle's place among those recorded + whether it is seen from behind

#ifdef MASKED
#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/image/footprint.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
} push;

#include "ground/image/mask.glsl"
#endif

void main() {
#ifdef MASKED
    Triangle t = triangles[in_triangle];
    Attributes attributes = attributes_of(in_triangle);
    COUNT(TRIANGLES, 1u);
    uint covered = covered_samples(t, attributes, pixel_footprint(attributes, in_weights));
    if (covered == 0u) {
        COUNT_ALL();
        discard;
    }
    gl_SampleMask[0] = int(covered);
#endif
    out_seen = 1u + 2u * in_triangle + in_back;
}
