// Holes of alpha masks in a triangle. Needs: push.first_seen.
//! given layout(push_constant) uniform Push { uint first_row; uint first_seen; } push;

#include "ground/image/seen.glsl"

// Returns the samples of `asked`, a bit each, at which the triangle has no hole. `pixel` is counted within the band.
uint unmasked(Triangle t, Attributes attributes, uvec2 pixel, uint asked) {
    vec3 facet = normalize(triangle_normal(t.corners[0], t.corners[1], t.corners[2]));
    vec2 place = vec2(pixel + uvec2(0u, push.first_seen));
    Footprint footprint = POINT;
    if (!feature(FEATURE_POINTS)) {
        footprint = pixel_footprint(attributes, place_on_triangle(place + 0.5, vec2(1.0), t, facet));
    }
    Material m = materials[t.material];
    uint kept = 0u;
    for (uint left = asked; left != 0u; left &= left - 1u) {
        uint i = uint(findLSB(left));
        vec3 weights = seen_weights(place + sample_place(i), t, facet);
        vec4 color = base_color(m, between(attributes.uvs, weights), between(attributes.colors, weights), footprint);
        kept |= surface_alpha(m, color.a) > 0.0 ? 1u << i : 0u;
    }
    return kept;
}
