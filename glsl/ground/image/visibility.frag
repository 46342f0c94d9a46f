#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MASKED
// Which triangle every sample of the image sees: a visibility buffer (Burns and Hunt, JCGT 2013). With MASKED, alpha
// masks leave holes.

layout(location = 0) flat in uint in_triangle;
layout(location = 1) flat in uint in_back;

// 1 + 2 × the triangle's place among those recorded + whether it is seen from behind.
layout(location = 0) out uint out_seen;

#ifdef MASKED
#include "ground/image/seen.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // the first row that the band sees
} push;

bool passes_mask(vec2 place, Triangle t, vec3 facet, Attributes attributes, Footprint footprint) {
    vec3 weights = seen_weights(place, t, facet);
    vec4 uv = between(attributes.uvs, weights);
    Material m = materials[t.material];
    return surface_alpha(m, base_color(m, uv, between(attributes.colors, weights), footprint).a) > 0.0;
}

// Of a pixel's samples.
uint unmasked(Triangle t, Attributes attributes) {
    vec3 facet = normalize(triangle_normal(t.corners[0], t.corners[1], t.corners[2]));
    vec2 pixel = floor(gl_FragCoord.xy) + vec2(0.0, float(push.first_seen));
    Footprint footprint = pixel_footprint(attributes, place_on_triangle(pixel + 0.5, vec2(1.0), t, facet));
    uint kept = 0u;
    for (uint i = 0u; i < frame.samples; i++) {
        kept |= passes_mask(pixel + sample_place(i), t, facet, attributes, footprint) ? 1u << i : 0u;
    }
    return kept;
}
#endif

void main() {
#ifdef MASKED
    Triangle t = triangles[in_triangle];
    COUNT(TRIANGLES, 1u);
    gl_SampleMask[0] = ~0;
    if ((materials[t.material].flags & MATERIAL_MASK) != 0u) {
        uint kept = unmasked(t, attributes_of(in_triangle));
        if (kept == 0u) {
            COUNT_ALL();
            discard;
        }
        gl_SampleMask[0] = int(kept);
    }
#endif
    out_seen = 1u + 2u * in_triangle + in_back;
}
