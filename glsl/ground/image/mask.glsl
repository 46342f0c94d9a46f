// Which samples of a pixel a triangle covers, its alpha mask included. Needs: push.first_row.

#include "common/closest_point.glsl"
#include "ground/image/image_samples.glsl"

// Of the image, where a band's first row is none of its own.
uvec2 drawn_pixel() {
    return uvec2(gl_FragCoord.xy) + uvec2(0u, push.first_row);
}

uint covered_samples(Triangle t, Attributes attributes, Footprint footprint) {
    uint covered = frame.samples == 1u ? 1u : uint(gl_SampleMaskIn[0]) & 15u;
    Material m = materials[t.material];
    if (!feature(FEATURE_MASK) || (m.flags & MATERIAL_MASK) == 0u) {
        return covered;
    }
    vec3 a = t.corners[0];
    vec3 b = t.corners[1];
    vec3 c = t.corners[2];
    vec3 facet = normalize(triangle_normal(a, b, c));
    uint kept = 0u;
    for (uint i = 0u; i < frame.samples; i++) {
        if ((covered & (1u << i)) != 0u) {
            vec2 bc = barycentric(a, b, c, seen_point(vec2(drawn_pixel()) + sample_place(i), a, facet));
            vec3 weights = vec3(1.0 - bc.x - bc.y, bc);
            float alpha = base_color(m, between(attributes.uvs, weights), between(attributes.colors, weights), footprint).a;
            kept |= surface_alpha(m, alpha) > 0.0 ? 1u << i : 0u;
        }
    }
    return kept;
}
