// Results of the passes gather and share, upsampled to the image. Needs: push.first_row.
//! with GATHERED
//! with METHOD_GATHERS_LOBES
//! given layout(push_constant) uniform Push { uint first_row; } push;

#include "ground/lamp_light.glsl"
#include "ground/image/likeness.glsl"
#include "ground/image/linked.glsl"

struct Gathered {
    vec4 light; // E/π in stored radiance; unoccluded share
    LampLight lamps;
    bool found;
    bool found_lamps; // for lamps; otherwise the pixel computes its own
    bool found_lamp_lobes; // and for the specular reflection of lamps
    vec3 mirrored; // stored radiance of the specular lobe, if a method gathers it
    bool crumb; // nothing was found, and hardly any gathered pixels around this one share light with each other
};

Gathered nothing_gathered() {
    return Gathered(vec4(0.0, 0.0, 0.0, 1.0), no_lamp_light(), false, false, false, vec3(0.0), false);
}

#ifdef GATHERED
uniform sampler2D shared_light;
uniform sampler2D shared_lamps; // stored radiance, diffuse and specular
uniform sampler2D shared_lamps_specular;
#ifdef METHOD_GATHERS_LOBES
uniform sampler2D shared_mirrored;
#endif
uniform sampler2D surfaces; // position, packed normal and links

// The maximum difference of lamps' unshadowed shares among gathered pixels around a pixel; it is larger at the edge of
// a shadow.
const float OPEN_APART = 0.25;
const float LEAST_LIKENESS = 1e-3;
// The minimum likeness of two places that share the specular reflection of lamps.
const float MIRRORED_ALIKE = 0.5;
// The number of gathered pixels beyond the four nearest that are searched if none of these shows the surface.
const int WIDER = 2;
// The number of links among all of these below which a surface is a crumb: a quarter of the links of one surface.
const uint CRUMB_LINKS = uint(2 * (WIDER + 1) * (WIDER + 1));
// Rows that a band gathers above and below its own, so that neighbours and their links exist.
const uint GATHER_MARGIN = INTERLEAVE / 2u + 2u + uint(WIDER);

// Cosines of 10° and 4°: if four pixels are not linked, a wall or a crease may lie between the pixel and one of them,
// so only surfaces with nearly its normal count.
const float LEAST_FACING = 0.9848;
const float FACING = 0.9976;

// Whether nothing lies between the four gathered pixels from `corner`, in a band of `size`.
bool all_linked(ivec2 corner, ivec2 size) {
    uvec3 links;
    for (int k = 0; k < 3; k++) {
        ivec2 at = clamp(corner + ivec2(k & 1, k >> 1), ivec2(0), size - 1);
        links[k] = unpack_links(texelFetch(surfaces, at, 0).w);
    }
    return links.x == (LINK_RIGHT | LINK_DOWN) && (links.y & LINK_DOWN) != 0u && (links.z & LINK_RIGHT) != 0u;
}

// A position on the border of a square of pixels that extends `ring` beyond a square of two by two, relative to the
// corner of the latter; `k` is from 0 to 8 · ring + 3.
ivec2 on_ring(int ring, int k) {
    int side = 2 * ring + 1;
    int along = k % side;
    ivec2 at = ivec2(along, 0);
    at = k / side == 1 ? ivec2(side, along) : at;
    at = k / side == 2 ? ivec2(side - along, side) : at;
    at = k / side == 3 ? ivec2(0, side - along) : at;
    return at - ring;
}

// The light of gathered pixels around this one that lie on the same surface: of the four nearest or, if these show
// other surfaces, of those around them. At edges and among small triangles this has less noise than a few rays of the
// pixel's own, and is cheaper. If something lies between the four, rays decide which pixels count. Lamps are left to
// the pixel itself if the four show other surfaces too, or the edge of a shadow; so is their specular reflection in a
// lobe of that α if the four have other normals.
Gathered gathered_nearby(uvec2 pixel, vec3 position, vec3 normal, float alpha) {
    uvec2 image = uvec2(frame.image_size);
    ivec2 size = ivec2((image + GATHER_SCALE - 1u) / GATHER_SCALE);
    ivec2 origin = ivec2(0, max(int(push.first_row / GATHER_SCALE) - int(GATHER_MARGIN), 0));
    vec2 at = (vec2(pixel) + 0.5) / frame.image_size * vec2(size) - 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 part = at - vec2(corner);
    Gathered sum = nothing_gathered();
    sum.light = vec4(0.0);
    float total = 0.0;
    bool all_count = true;
    uint links = 0u;
    float least_alike = 1.0;
    vec2 open = vec2(1.0, 0.0); // the least and the largest unshadowed share of lamps
    bool asks_rays = LINKED && !all_linked(corner - origin, size - origin);
    for (int ring = 0; ring <= WIDER && total <= LEAST_LIKENESS; ring++) {
        for (int k = 0; k < 8 * ring + 4; k++) {
            ivec2 step = on_ring(ring, k);
            ivec2 texel = clamp(corner + step, ivec2(0), size - 1) - origin;
            vec4 there = texelFetch(surfaces, texel, 0);
            vec3 other = unpack_normal(max(there.w, 0.0));
            vec2 away = abs(vec2(step) - part);
            float close = ring == 0 ? (1.0 - away.x) * (1.0 - away.y) : 1.0 / (1.0 + dot(away, away));
            float weight = there.w < 0.0 ? 0.0 : close * likeness(position, normal, there.xyz, other);
            // This is a loop, which a CPU device leaves early.
            for (uint tests = asks_rays && weight > 0.0 ? 1u : 0u; tests > 0u; tests--) {
                weight *= smoothstep(LEAST_FACING, FACING, dot(normal, other));
                weight = linked(position, normal, there.xyz, other) ? weight : 0.0;
            }
            links += uint(bitCount(unpack_links(there.w)));
            total += weight;
            all_count = all_count && (close == 0.0 || weight > 0.0);
            sum.light += weight * texelFetch(shared_light, texel, 0);
            if (LAMPS == LAMPS_SAMPLED) {
                vec4 of_lamps = texelFetch(shared_lamps, texel, 0);
                sum.lamps.diffuse += weight * of_lamps.rgb;
                open = weight > 0.0 ? vec2(min(open.x, of_lamps.w), max(open.y, of_lamps.w)) : open;
                if (feature(FEATURE_SPECULAR) && weight > 0.0) {
                    least_alike = min(least_alike, mirrored_alike(position, normal, there.xyz, other, alpha));
                    sum.lamps.specular += weight * texelFetch(shared_lamps_specular, texel, 0).rgb;
                }
            }
#ifdef METHOD_GATHERS_LOBES
            if (feature(FEATURE_SPECULAR)) {
                sum.mirrored += weight * texelFetch(shared_mirrored, texel, 0).rgb;
            }
#endif
        }
    }
    sum.found = total > LEAST_LIKENESS;
    sum.crumb = LINKED && !sum.found && links < CRUMB_LINKS;
    sum.found_lamps = sum.found && all_count && open.y - open.x < OPEN_APART;
    sum.found_lamp_lobes = sum.found_lamps && least_alike > MIRRORED_ALIKE;
    float mean = sum.found ? 1.0 / total : 0.0;
    sum.light *= mean;
    sum.mirrored *= mean;
    sum.lamps.diffuse *= mean / frame.scale;
    sum.lamps.specular *= mean / frame.scale;
    return sum;
}
#endif
