#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method except none
//! with ASKS only rays
// Gather: diffuse light of visible surfaces, at fewer pixels than the image has, each with different directions. The
// pass share averages over neighbours, and the pass image upsamples. A thread per gathered pixel. With ASKS it requests
// the light of list items instead.

#include "common/tile.glsl"
#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"
#include "ground/lamp_light.glsl"
#include "ground/image/fragments.glsl"
#include "ground/image/gathers.glsl"
#include "ground/image/likeness.glsl"
#include "ground/image/seen.glsl"

layout(local_size_x = 64) in;

layout(push_constant) uniform Push {
    uint first_row; // first gathered row of this band
    uint first; // among the band's gathered rows
    uint end;
    uint first_seen; // the first row of the image that the band sees
} push;

layout(rgba32f) writeonly uniform image2D gathered_surfaces; // position, voxels; packed normal, −1 without gathering
layout(rgba16f) writeonly uniform image2D gathered_light; // E/π in stored radiance; unoccluded share of the hemisphere
layout(rgba16f) writeonly uniform image2D gathered_lamps; // the same for sampled lamps; unshadowed share
layout(rgba16f) writeonly uniform image2D gathered_lamps_specular; // stored radiance; α of the narrowest lobe
#ifdef METHOD_GATHERS_LOBES
layout(rgba16f) writeonly uniform image2D gathered_mirrored; // stored radiance of the specular lobe
#endif

// The sample of the image that is nearest to a position in pixels.
struct SampleAt {
    uvec2 pixel;
    uint index;
};

SampleAt nearest_sample(vec2 place) {
    uvec2 pixel = min(uvec2(place), uvec2(frame.image_size) - 1u);
    SampleAt nearest = SampleAt(pixel, 0u);
    float least = 2.0;
    for (uint i = 0u; i < frame.samples; i++) {
        vec2 away = vec2(pixel) + sample_place(i) - place;
        nearest.index = dot(away, away) < least ? i : nearest.index;
        least = min(least, dot(away, away));
    }
    return nearest;
}

// The entry of the visibility buffer at the position.
uint seen_at(SampleAt at) {
    COUNT(WORDS, 1u);
    uint of_pixel = pixel_fragments[(at.pixel.y - push.first_seen) * uint(frame.image_size.x) + at.pixel.x];
    uint first = of_pixel >> COUNT_BITS;
    uint seen = 0u;
    for (uint slot = first; slot < first + (of_pixel & (1u << COUNT_BITS) - 1u); slot++) {
        COUNT(WORDS, 2u);
        Fragment f = fragments[slot];
        seen = (samples_of(f) & 1u << at.index) != 0u ? f.seen : seen;
    }
    return seen;
}

// Whether all pixels around a position show only that entry: then its triangle is there without anything in front.
bool is_shown_about(vec2 place, uint id) {
    ivec2 corner = ivec2(floor(place - 0.5));
    vec2 part = place - 0.5 - vec2(corner);
    bool alone = true;
    for (int k = 0; k < 4; k++) {
        ivec2 step = ivec2(k & 1, k >> 1);
        bool counts = all(greaterThan(mix(1.0 - part, part, equal(step, ivec2(1))), vec2(1e-3)));
        uvec2 pixel = counts ? min(uvec2(corner + step), uvec2(frame.image_size) - 1u) : uvec2(place);
        COUNT(WORDS, 3u);
        uint of_pixel = pixel_fragments[(pixel.y - push.first_seen) * uint(frame.image_size.x) + pixel.x];
        Fragment first = fragments[of_pixel >> COUNT_BITS];
        bool whole = (of_pixel & (1u << COUNT_BITS) - 1u) == 1u && samples_of(first) == (1u << frame.samples) - 1u;
        alone = alone && (!counts || whole && first.seen == id);
    }
    return alone;
}

void main() {
    vec2 size = gathered_pixel();
    // Threads beyond the last column or row repeat its work.
    ivec2 last = ivec2(imageSize(gathered_light).x, push.end) - 1;
    uvec2 own = gl_WorkGroupID.yz * 16u + place_in_tile(gl_GlobalInvocationID.x);
    ivec2 at = min(ivec2(own) + ivec2(0, push.first), last);
    uvec3 place = uvec3(at, 0u) + uvec3(0u, push.first_row, 0u);
    vec2 center = (vec2(place.xy) + 0.5) * size;
    SampleAt from = nearest_sample(center);
    uint id = seen_at(from);
    vec4 surface = vec4(0.0, 0.0, 0.0, -1.0);
    vec4 light = vec4(0.0);
    vec3 mirrored = vec3(0.0);
    LampLight lamps = no_lamp_light();
    float alpha = 1.0;
    // These are loops, which a CPU device leaves early.
    for (uint i = 0u; i < min(id, 1u); i++) {
        uint triangle = (id - 1u) / 2u;
        Triangle t = triangles[triangle];
        Attributes attributes = attributes_of(triangle);
        COUNT(TRIANGLES, 1u);
        COUNT(MATERIALS, 1u);
        vec3 facet = normalize(triangle_normal(t.corners[0], t.corners[1], t.corners[2]));
        // The position is at the centre if it shows the same triangle, because light that is gathered beside it would
        // appear shifted.
        vec2 spot = is_shown_about(center, id) ? center : vec2(from.pixel) + sample_place(from.index);
        PlaceOnTriangle middle = place_on_triangle(spot, size, t, facet);
        Surface s =
            evaluate_surface(t, attributes, middle.weights, pixel_footprint(attributes, middle), (id & 1u) == 0u);
        vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
        for (uint k = 0u; k < (gathers(s) ? 1u : 0u); k++) {
            surface = vec4(s.position, pack_normal(s.normal));
#ifdef METHOD_GATHERS_LOBES
            light = look_up_for_view(s, view, place, false, mirrored);
#else
            light = look_up_diffuse(s, place);
#endif
#ifndef ASKS
            lamps = lamp_light(s, view);
            alpha = narrowest_alpha(s);
#endif
        }
    }
    imageStore(gathered_surfaces, at, surface);
#ifndef ASKS
    imageStore(gathered_light, at, light);
    imageStore(gathered_lamps, at, vec4(min(lamps.diffuse * frame.scale, LARGEST_STORED), lamps.open));
    imageStore(gathered_lamps_specular, at, vec4(min(lamps.specular * frame.scale, LARGEST_STORED), alpha));
#ifdef METHOD_GATHERS_LOBES
    if (feature(FEATURE_SPECULAR)) { // otherwise there is no such image
        imageStore(gathered_mirrored, at, vec4(min(mirrored, LARGEST_STORED), 0.0));
    }
#endif
#endif
}
