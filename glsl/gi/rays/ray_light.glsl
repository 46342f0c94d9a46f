// A ray that finds its triangle exactly and takes the light that the triangle itself sends there.

#include "ground/ray.glsl"
#include "ground/boxes.glsl"
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

// 1-based: the item that stands for a recorded triangle at a place on it; 0 if there is none.
uint item_at(uint triangle, vec3 at) {
    uint found = 0u;
    // Beside a plane between voxels rounding may lead into the other one.
    Box near = box_at(at);
    vec3 aside = (1e-3 / near.scale) * mix(vec3(-1.0), vec3(1.0), greaterThanEqual(fract(in_box(near, at)), vec3(0.5)));
    for (uint k = 0u; k < 8u && found == 0u; k++) {
        vec3 p = at + aside * vec3((uvec3(k) >> uvec3(0u, 1u, 2u)) & 1u);
        Box box = box_at(p);
        uint item = heads[voxel_in(box, ivec3(floor(in_box(box, p))))];
        COUNT(HEADS, 1u);
        for (uint i = 0u; i < globals.item_count && item != 0u; i++) {
            ListItem entry = list_items[item - 1u];
            COUNT(LIST_ITEMS, 1u);
            found = entry.triangle == triangle ? item : 0u;
            item = found == 0u ? entry.next : 0u;
        }
    }
    return found;
}

// Which item is lit for what was met: of a split item and its twin the one that sees it. What neither sees is cut off
// from both: it stays dark, since no light may pass there.
uint lit_for(Met met) {
    mat3 corners = corners_of(met.triangle);
    vec3 hit = corners * met.weights;
    uint own = item_at(met.place, hit);
    uint item = item_parts[max(own, 1u) - 1u].lit_by;
    ItemPart part = item_parts[item];
    COUNT(WORDS, 3u);
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
}

// Stored radiance of what was met along unit d, on the side that is seen: what the list item sends there that stands
// for it where it was met. No other surface and no other side mixes into it, however thin a wall is. `mirrors`: between
// there and the eye, each a bounce. Items hold the light of all bounces but one.
vec3 seen_radiance(Met met, vec3 d, uint mirrors) {
    uint item = met.any ? lit_for(met) : UNLIT;
    COUNT(WORDS, item != UNLIT ? 3u : 0u);
    bool lit = item != UNLIT;
    item = lit ? item : 0u;
    vec3 seen = met.back ? seen_lights[item].back : seen_lights[item].front;
    if (BOUNCES == 2u && mirrors == 2u) {
        seen = direct_light[2u * item + (met.back ? 1u : 0u)];
    }
    if (feature(FEATURE_SPECULAR)) {
        uvec2 lobe = seen_lobes[2u * item + (met.back ? 1u : 0u)];
        COUNT(WORDS, 2u);
        seen += lobe == uvec2(0u) ? vec3(0.0)
                                  : item_lobe_light(unpack_item_lobe(lobe), met.back ? -met.normal : met.normal, -d);
    }
    return lit && mirrors <= BOUNCES ? seen : vec3(0.0);
}

// Leaves along unit d, which is above a surface with normal `facet`. Stored radiance of what it meets; `through`: what
// of the light behind all of that gets there, per channel.
vec3 trace_light(vec3 position, vec3 facet, vec3 d, out vec3 through) {
    vec3 origin = position + facet * ray_start_at(position);
    through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_PASSING) ? MOST_PASSED : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        vec3 passed = transmittance(met);
        sum += met.any && !met.dark ? through * (1.0 - passed) * seen_radiance(met, d, 0u) : vec3(0.0);
        through *= met.any ? passed : vec3(1.0);
        bool spent = brightest(through) < SPENT;
        through = spent ? vec3(0.0) : through;
        going = met.any && !spent;
        least = met.distance;
    }
    return sum;
}
