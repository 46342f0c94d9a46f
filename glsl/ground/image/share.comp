#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOBES
// Share: every gathered pixel takes the mean over its neighbours on the same surface. The square has an odd side, and
// its border has half weight, so that each of the INTERLEAVE² patterns has the same weight. A neighbour counts if a
// chain of links leads to it, each away from the middle. Later passes over a still image share over half the distance,
// because noise averages out and blur does not.

#include "ground/constants.glsl"
#include "ground/layout.glsl"

#include "ground/frame.glsl"

#include "ground/image/likeness.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D surfaces; // position, packed normal and links, −1 without gathering
uniform sampler2D light;
uniform sampler2D lamps;
uniform sampler2D lamps_specular;
layout(rgba16f) writeonly uniform image2D shared_light;
layout(rgba16f) writeonly uniform image2D shared_lamps;
layout(rgba16f) writeonly uniform image2D shared_lamps_specular;
#ifdef LOBES
uniform sampler2D mirrored;
layout(rgba16f) writeonly uniform image2D shared_mirrored;
#endif

layout(push_constant) uniform Push {
    uint rows; // of this band
} push;

const int REACH = int(INTERLEAVE / 2u);
const uint FAR_PASSES = 4u; // number of passes that share over all of REACH

// The right links and the lower links of a row's pixels from x − REACH, one bit each, the lowest bit first. `at` may
// lie outside of an image of `size`, which no link leaves.
uvec2 links_of_row(ivec2 at, ivec2 size) {
    uvec2 row = uvec2(0u);
    for (int x = -REACH; x <= REACH; x++) {
        ivec2 to = at + ivec2(x, 0);
        bool inside = all(greaterThanEqual(to, ivec2(0))) && all(lessThan(to, size));
        uint of_pixel = !LINKED ? LINK_RIGHT | LINK_DOWN : inside ? unpack_links(texelFetch(surfaces, to, 0).w) : 0u;
        row.x |= (of_pixel & LINK_RIGHT) != 0u ? 1u << (x + REACH) : 0u;
        row.y |= (of_pixel & LINK_DOWN) != 0u ? 1u << (x + REACH) : 0u;
    }
    return row;
}

// The pixels of a row that right links reach, away from its middle, from those in `found`.
uint along_row(uint found, uint rights) {
    for (int x = 0; x < REACH; x++) {
        uint right = 1u << (REACH + x);
        uint left = 1u << (REACH - x);
        found |= (found & rights & right) << 1u;
        found |= (found & left) >> 1u & rights;
    }
    return found;
}

// Whether two unshadowed shares of lamps, each estimated with LAMP_POINTS points, may be equal.
float open_alike(float a, float b) {
    float mean = 0.5 * (a + b);
    float variance = 2.0 * mean * (1.0 - mean) / float(LAMP_POINTS);
    return exp(-0.5 * (a - b) * (a - b) / max(variance, 1e-6));
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(textureSize(light, 0).x, push.rows);
    if (any(greaterThanEqual(at, size))) {
        return;
    }
    vec4 here = texelFetch(surfaces, at, 0);
    vec3 normal = unpack_normal(max(here.w, 0.0));
    vec4 sum = vec4(0.0);
    vec4 lamp_sum = vec4(0.0);
    vec4 specular_sum = vec4(0.0);
    vec4 mirrored_sum = vec4(0.0);
    int reach = frame.image_pass < FAR_PASSES ? REACH : REACH / 2;
    float total = 0.0;
    float lamp_total = 0.0;
    float specular_total = 0.0;
    float open = LAMPS == LAMPS_SAMPLED ? texelFetch(lamps, at, 0).w : 1.0;
    float alpha = LAMPS == LAMPS_SAMPLED ? texelFetch(lamps_specular, at, 0).w : 0.0;
    // The pixel's own row, then those below, then those above.
    uvec2 own_links = links_of_row(at, size);
    uvec2 links = own_links;
    uint own = along_row(1u << REACH, own_links.x);
    uint found = own;
    for (int k = 0; k <= 2 * REACH; k++) {
        int y = k <= REACH ? k : REACH - k;
        if (k > 0) {
            bool turns = k == REACH + 1;
            uvec2 before = turns ? own_links : links;
            links = links_of_row(at + ivec2(0, y), size);
            // A lower link is stored at the upper one of its two pixels.
            found = along_row((turns ? own : found) & (y > 0 ? before : links).y, links.x);
        }
        for (int x = -REACH; x <= REACH; x++) {
            ivec2 to = at + ivec2(x, y);
            vec4 there = texelFetch(surfaces, clamp(to, ivec2(0), size - 1), 0);
            bool near = max(abs(x), abs(y)) <= reach;
            bool counts = near && all(greaterThanEqual(to, ivec2(0))) && all(lessThan(to, size)) && there.w >= 0.0
                && (found & 1u << (x + REACH)) != 0u;
            float border = (abs(x) == reach ? 0.5 : 1.0) * (abs(y) == reach ? 0.5 : 1.0);
            vec3 other = unpack_normal(max(there.w, 0.0));
            float weight = counts ? border * likeness(here.xyz, normal, there.xyz, other) : 0.0;
            to = clamp(to, ivec2(0), size - 1);
            sum += weight * texelFetch(light, to, 0);
            if (LAMPS == LAMPS_SAMPLED) {
                vec4 of_lamps = texelFetch(lamps, to, 0);
                float alike = weight * open_alike(open, of_lamps.w);
                lamp_sum += alike * of_lamps;
                lamp_total += alike;
                if (feature(FEATURE_SPECULAR)) {
                    alike *= mirrored_alike(here.xyz, normal, there.xyz, other, alpha);
                    specular_sum += alike * texelFetch(lamps_specular, to, 0);
                    specular_total += alike;
                }
            }
#ifdef LOBES
            mirrored_sum += weight * texelFetch(mirrored, to, 0);
#endif
            total += weight;
        }
    }
    float mean = total > 0.0 ? 1.0 / total : 0.0;
    imageStore(shared_light, at, sum * mean);
#ifdef LOBES
    imageStore(shared_mirrored, at, mirrored_sum * mean);
#endif
    if (LAMPS == LAMPS_SAMPLED) {
        float lamp_mean = lamp_total > 0.0 ? 1.0 / lamp_total : 0.0;
        imageStore(shared_lamps, at, lamp_sum * lamp_mean);
        float specular_mean = specular_total > 0.0 ? 1.0 / specular_total : 0.0;
        imageStore(shared_lamps_specular, at, vec4(specular_sum.rgb * specular_mean, alpha));
    }
}
