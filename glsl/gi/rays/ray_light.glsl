// Exact rays that read the cached light of the triangle that they hit.

#include "ground/ray.glsl"
#include "common/facing.glsl"
#include "ground/boxes.glsl"
#include "ground/item_index.glsl"
#include "ground/on_plane.glsl"
#include "gi/rays/constants.glsl"
#include "gi/rays/sees.glsl"
#include "gi/rays/item_lobes.glsl"

layout(scalar) readonly buffer SeenLights { ItemLight seen_lights[]; }; // what list items sent one pass before

layout(scalar) readonly buffer SeenLobes { uvec2 seen_lobes[]; }; // and in lobes, per side

#ifndef LIGHTS_ITEMS
layout(scalar) readonly buffer DirectLight { vec3 direct_light[]; }; // per list item and side, stored radiance
#endif

const uint UNLIT = ~0u; // no item is lit for it

#ifdef ASKS
#include "ground/ask.glsl"

void ask_for(uint item) {
#ifdef LIGHTS_ITEMS
    const uint bounces = ASKED_FIRST;
#else
    const uint bounces = BOUNCES == 1u ? ASKED_FIRST : ASKED_FIRST | ASKED_SECOND;
#endif
    if (item != UNLIT) {
        ask(item, bounces);
    }
}
#endif

// The item of a recorded triangle at a point on it, 1-based; 0 if there is none.
uint item_at(uint triangle, vec3 at) {
    uint found = 0u;
    // Near a plane between voxels, rounding may select the other voxel.
    Box near = box_at(at);
    vec3 aside = (1e-3 / near.scale) * mix(vec3(-1.0), vec3(1.0), greaterThanEqual(fract(in_box(near, at)), vec3(0.5)));
    for (uint k = 0u; k < 8u && found == 0u; k++) {
        vec3 p = at + aside * vec3((uvec3(k) >> uvec3(0u, 1u, 2u)) & 1u);
        Box box = box_at(p);
        found = item_in(triangle, voxel_in(box, ivec3(floor(in_box(box, p)))));
    }
    return found;
}

// The item that is lit for the hit point: of a split item and its twin the one that sees it. A point that neither sees
// is cut off from both and stays dark, because no light may pass there.
uint lit_for(Met met) {
    mat3 corners = corners_of(met.triangle);
    vec3 hit = corners * met.weights;
    uint own = item_at(met.place, hit);
    uint item = item_parts[max(own, 1u) - 1u].lit_by;
    ItemPart part = item_parts[item];
    COUNT(WORDS, 3u);
#ifdef ASKS
    return own == 0u ? UNLIT : item; // its twin is requested with it
#else
    if (own == 0u || part.twin == 0u) {
        return own == 0u ? UNLIT : item;
    }
    ListItem entry = list_items[item];
    COUNT(LIST_ITEMS, 1u);
    COUNT(CORNERS, 3u);
    COUNT(WORDS, 1u);
    Box box = box_of(entry.voxel);
    vec3 a = in_box(box, triangles[entry.triangle].corners[0]);
    vec3 n = triangle_normal(
        a, in_box(box, triangles[entry.triangle].corners[1]), in_box(box, triangles[entry.triangle].corners[2]));
    vec3 center = vec3(cell_in(box, entry.voxel)) + 0.5;
    float side = met.back ? -ray_start_in(box) : ray_start_in(box);
    hit += side * met.normal;
    vec3 above = side * normalize(n);
    if (sees(entry.voxel, item, hit, from_box(box, anchor_point(a, n, center, part.anchor)) + above)) {
        return item;
    }
    uint twin = part.twin - 1u;
    vec3 other = from_box(box, anchor_point(a, n, center, item_parts[twin].anchor)) + above;
    return sees(entry.voxel, item, hit, other) ? twin : UNLIT;
#endif
}

// Stored radiance that a lit item sends uniformly from one side; 0 is its front. `mirrors` counts mirrors between this
// point and the eye, each a bounce. Items hold the light of all bounces except one.
vec3 even_radiance(uint item, uint side, uint mirrors) {
    COUNT(WORDS, 3u);
    if (BOUNCES == 2u && mirrors == 2u) {
        return direct_light[2u * item + side];
    }
    return side == 1u ? seen_lights[item].back : seen_lights[item].front;
}

// Stored radiance that the specular lobe of a lit item reflects back along unit d from the hit point.
vec3 lobe_radiance(uint item, Met met, vec3 d) {
    if (!feature(FEATURE_SPECULAR)) {
        return vec3(0.0);
    }
    uvec2 lobe = seen_lobes[2u * item + (met.back ? 1u : 0u)];
    COUNT(WORDS, 2u);
    return lobe == uvec2(0u) ? vec3(0.0)
                             : item_lobe_light(unpack_item_lobe(lobe), met.back ? -met.normal : met.normal, -d);
}

// Stored radiance of the hit point along unit d: radiance of the list item that covers it. No other surface or side
// contributes, however thin a wall is.
vec3 seen_radiance(Met met, vec3 d) {
    uint item = met.any ? lit_for(met) : UNLIT;
    uint lit = item == UNLIT ? 0u : item;
#ifdef ASKS
    ask_for(item);
    return vec3(0.0);
#else
    vec3 seen = even_radiance(lit, met.back ? 1u : 0u, 0u) + lobe_radiance(lit, met, d);
    return item == UNLIT ? vec3(0.0) : seen;
#endif
}

// The item that is lit for a voxel of a box, if the voxel lists only one surface, with that material and orientation;
// else UNLIT.
uint continued_in(Box box, ivec3 voxel, uint material, uint facing) {
    bool inside = all(greaterThanEqual(voxel, ivec3(0))) && all(lessThan(voxel, ivec3(EDGE)));
    uint head = inside ? heads[voxel_in(box, voxel)] : 0u;
    uint item = item_parts[max(head, 1u) - 1u].lit_by;
    Triangle t = triangles[list_items[item].triangle];
    COUNT(HEADS, 1u);
    COUNT(WORDS, 2u);
    COUNT(LIST_ITEMS, 1u);
    COUNT(TRIANGLES, 1u);
    bool continues = head != 0u && item_parts[item].alone != 0u && t.material == material
        && facing_cell(triangle_normal(t.corners[0], t.corners[1], t.corners[2])) == facing;
    return continues ? item : UNLIT;
}

// Stored radiance of the hit point as seen in mirrors and glass. The uniform part is interpolated linearly between the
// middles of voxels along the surface if the surface continues in the neighbouring voxels and nothing else is listed
// there; this hides single voxels and the noise of the few directions of each item. `width` is that of the ray in
// voxels; a wide ray shows no single voxel.
vec3 shown_radiance(Met met, vec3 d, uint mirrors, float width) {
    uint item = met.any && mirrors <= BOUNCES ? lit_for(met) : UNLIT;
    uint own = item == UNLIT ? 0u : item;
    uint side = met.back ? 1u : 0u;
    Box box = box_of(list_items[own].voxel);
#ifdef ASKS
    ask_for(item);
#endif
    vec3 sum = even_radiance(own, side, mirrors);
    float total = 1.0;
    bool interpolates = item != UNLIT && width * box.scale < 1.0 && item_parts[own].alone != 0u;
    for (uint once = 0u; once < (interpolates ? 1u : 0u); once++) {
        ivec3 voxel = ivec3(cell_in(box, list_items[own].voxel));
        Triangle t = triangles[list_items[own].triangle];
        vec3 n = triangle_normal(t.corners[0], t.corners[1], t.corners[2]);
        uint facing = facing_cell(n);
        uint axis = dominant_axis(n);
        vec3 hit = in_box(box, corners_of(met.triangle) * met.weights);
        vec2 off = clamp(across(hit - vec3(voxel) - 0.5, axis), -0.5, 0.5);
        ivec2 way = ivec2(off.x < 0.0 ? -1 : 1, off.y < 0.0 ? -1 : 1);
        off = abs(off);
        total = (1.0 - off.x) * (1.0 - off.y);
        sum *= total;
        for (int k = 1; k < 4; k++) {
            ivec2 step = ivec2(k & 1, k >> 1);
            ivec3 beside = voxel;
            beside[(axis + 1u) % 3u] += step.x * way.x;
            beside[(axis + 2u) % 3u] += step.y * way.y;
            uint other = continued_in(box, beside, t.material, facing);
#ifdef ASKS
            ask_for(other);
#endif
            vec2 weights = mix(1.0 - off, off, equal(step, ivec2(1)));
            float weight = other == UNLIT ? 0.0 : weights.x * weights.y;
            sum += weight * even_radiance(other == UNLIT ? own : other, side, mirrors);
            total += weight;
        }
    }
    return item == UNLIT ? vec3(0.0) : sum / total + lobe_radiance(own, met, d);
}

// Traces a ray along unit d, which is above a surface with normal `facet`. Returns the stored radiance of the hit
// point; `through` is the share of light from behind that passes, per channel.
vec3 trace_light(vec3 position, vec3 facet, vec3 d, out vec3 through) {
    vec3 origin = position + facet * ray_start_at(position);
    through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_PASSING) ? MOST_PASSED : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        vec3 passed = transmittance(met);
        sum += met.any && !met.dark ? through * (1.0 - passed) * seen_radiance(met, d) : vec3(0.0);
        through *= met.any ? passed : vec3(1.0);
        bool spent = brightest(through) < SPENT;
        through = spent ? vec3(0.0) : through;
        going = met.any && !spent;
        least = met.distance;
    }
    return sum;
}
