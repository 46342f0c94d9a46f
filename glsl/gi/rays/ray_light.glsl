// A ray that finds its triangle exactly and takes the light that the triangle itself sends there.

#include "ground/ray.glsl"
#include "ground/on_plane.glsl"
#include "gi/rays/sees.glsl"

layout(set = 0, binding = 29, scalar) readonly buffer SeenLights { ItemLight seen_lights[]; }; // what list items sent one pass before

const uint UNLIT = ~0u; // no item is lit for it

// Which item is lit for what was met: of a split item and its twin the one that sees it. What neither sees is cut off from both:
// it stays dark, since no light may pass there.
uint lit_for(Met met) {
    uint item = item_parts[met.item].lit_by;
    ItemPart part = item_parts[item];
    COUNT(WORDS, 3u);
    if (part.twin == 0u) {
        return item;
    }
    ListItem entry = list_items[item];
    COUNT(LIST_ITEMS, 1u);
    COUNT(CORNERS, 3u);
    COUNT(WORDS, 1u);
    vec3 a = triangles[entry.triangle].vertices[0].position;
    vec3 n = triangle_normal(a, triangles[entry.triangle].vertices[1].position, triangles[entry.triangle].vertices[2].position);
    vec3 center = vec3(cell_at(entry.voxel, EDGE)) + 0.5;
    float side = met.back ? -RAY_START : RAY_START;
    mat3 corners = corners_of(met.triangle);
    vec3 hit = corners * met.weights + side * met.normal;
    vec3 above = side * normalize(n);
    if (sees(entry.voxel, item, hit, anchor_point(a, n, center, part.anchor) + above)) {
        return item;
    }
    uint twin = part.twin - 1u;
    vec3 other = anchor_point(a, n, center, item_parts[twin].anchor) + above;
    return sees(entry.voxel, item, hit, other) ? twin : UNLIT;
}

// Stored radiance of what was met, on the side that is seen: what the list item sends that stands for it where it was met.
// No other surface and no other side mixes into it, however thin a wall is.
vec3 seen_radiance(Met met) {
    uint item = met.any ? lit_for(met) : UNLIT;
    COUNT(WORDS, item != UNLIT ? 3u : 0u);
    bool lit = item != UNLIT;
    item = lit ? item : 0u;
    vec3 seen = met.back ? seen_lights[item].back : seen_lights[item].front;
    return lit ? seen : vec3(0.0);
}

// Leaves along unit d, which is above a surface with normal `facet`: rgb = stored radiance of what it meets, a = 1 − what is open.
vec4 trace_light(vec3 position, vec3 facet, vec3 d) {
    vec3 origin = position + facet * RAY_START;
    vec3 through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_ALPHA) ? MOST_PASSED : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        vec3 passed = transmittance(met);
        sum += met.any && !met.dark ? through * (1.0 - passed) * seen_radiance(met) : vec3(0.0);
        through *= met.any ? passed : vec3(1.0);
        bool spent = brightest(through) < SPENT;
        through = spent ? vec3(0.0) : through;
        going = met.any && !spent;
        least = met.distance;
    }
    return vec4(sum, 1.0 - (through.r + through.g + through.b) / 3.0);
}
