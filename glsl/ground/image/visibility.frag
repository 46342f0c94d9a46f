#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MASKED
// The visible triangle of every sample: a visibility buffer (Burns and Hunt, JCGT 2013). With MASKED, alpha masks leave
// holes.

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

// 1 + 2 × the index of the recorded triangle + whether it is seen from behind.
layout(location = 0) out uint out_seen;

#ifdef MASKED
layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // the first row that the band sees
} push;

#include "ground/image/holes.glsl"
#endif

void main() {
#ifdef MASKED
    Triangle t = triangles[in_triangle];
    COUNT(TRIANGLES, 1u);
    gl_SampleMask[0] = ~0;
    if ((materials[t.material].flags & MATERIAL_MASK) != 0u) {
        uint all = (1u << frame.samples) - 1u;
        uint kept = unmasked(t, attributes_of(in_triangle), uvec2(gl_FragCoord.xy), all);
        if (kept == 0u) {
            COUNT_ALL();
            discard;
        }
        gl_SampleMask[0] = int(kept);
    }
#endif
    out_seen = 1u + 2u * in_triangle + in_back;
}
