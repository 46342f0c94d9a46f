// The light of a list's item in its voxel, for each side: direct light and emission and, with LOOK_UP, the method's
// look-up. A method that stores the direct light of specular lobes separately defines METHOD_LOBES, keep_lobe() and
// keep_no_lobe() before this file. These receive the stored irradiance, its specularly reflected part as uniform light,
// and the mean of the unit directions to the lights, and keep_lobe() returns the share that it keeps. A method that
// lights other points than the middle of an item's part defines METHOD_POINTS before this file.
//! per method
//! with LOOK_UP except none paths
//! given const bool CLIPS_ITEMS = true;
//! given const bool LIGHTS_FRONTS = false;
// The includer declares `const bool CLIPS_ITEMS`: whether the triangle is clipped to the voxel (otherwise the point
// nearest to the voxel's middle represents it), and `const bool LIGHTS_FRONTS`: whether only the front is lit, for
// fills without areas.

#define LIGHTS_ITEMS

layout(scalar) buffer DirectLight { vec3 direct_light[]; }; // per list item and side, stored radiance

#include "ground/brdf.glsl"
#include "common/clip.glsl"
#include "common/closest_point.glsl"
#include "ground/surface.glsl"
#ifdef LOOK_UP
#include "method/look_up.glsl"
#endif
#include "ground/sent_light.glsl"
#ifdef METHOD_POINTS
#include "method/item_point.glsl"
#endif

void keep_direct(uint place, vec3 stored) {
    if (DIRECT == DIRECT_KEPT) {
        direct_light[place] = stored;
    }
}

// The light of one side: stored radiance without opacity. `place` is its index among the direct lights.
vec3 light_side(Surface s, uvec3 voxel, uint place) {
    if (s.unlit) {
        keep_direct(place, vec3(0.0));
        return vec3(0.0); // neither lit nor emitting
    }
    Lobes lobes = lobes_at(s, MEAN_COSINE);
    vec3 stored;
    if (DIRECT == DIRECT_READ) {
        COUNT(WORDS, 3u);
        stored = direct_light[place];
    } else {
        stored = item_direct_light(s, lobes, place);
    }
    keep_direct(place, stored);
#ifdef LOOK_UP
    vec3 specular = feature(FEATURE_SPECULAR) ? lobes.specular : vec3(0.0);
    vec3 evenly = s.diffuse * lobes.diffuse + lobes.sheen;
#ifdef METHOD_GATHERS_LOBES
    evenly += gathered_share(s, lobes) * specular;
    specular *= 1.0 - gathered_share(s, lobes);
#endif
    for (uint side = 0u; side < lit_sides(s); side++) {
        vec3 share = side == 0u ? evenly : s.finish.diffused * lobes.diffuse;
        if (any(greaterThan(share, vec3(0.0)))) {
            stored += share * look_up_diffuse(side == 0u ? s : far_side(s), voxel).rgb;
        }
    }
    if (any(greaterThan(specular, vec3(0.0)))) {
        stored += specular * look_up_specular(s);
    }
#endif
    return clamp(stored, vec3(0.0), vec3(LARGEST_STORED));
}

// Item `index` of the lists, a part of `triangle`: clipped to its voxel and lit on each side. `corners` and `voxel` are
// in voxels of the lists' own grid.
ItemLight light_item(uint index, uint triangle, mat3 corners, uvec3 voxel) {
    Triangle t = triangles[triangle];
    Attributes attributes = attributes_of(triangle);
    COUNT(LIST_ITEMS, 1u);
    COUNT(TRIANGLES, 1u);
    vec3 a = corners[0];
    vec3 b = corners[1];
    vec3 c = corners[2];
    vec3 center = vec3(voxel) + 0.5;
    float area = 1.0;
    vec2 bc;
    if (CLIPS_ITEMS) {
        vec3 middle;
        clip_to_voxel(a, b, c, center, area, middle);
#ifdef METHOD_POINTS
        middle = item_point(index, a, b, c, center, middle);
#endif
        bc = area > 0.0 ? barycentric(a, b, c, middle) : vec2(0.0);
    } else {
        bc = closest_point(a, b, c, center);
    }
    Footprint footprint = footprint_over(attributes, corners);
#ifdef METHOD_POINTS
    // A mask filtered over the voxel would be all or nothing, and its colours would include those that are cut away.
    if (feature(FEATURE_ALPHA) && (materials[t.material].flags & MATERIAL_MASK) != 0u) {
        footprint = POINT;
    }
#endif
    Surface s = evaluate_surface(t, attributes, vec3(1.0 - bc.x - bc.y, bc), footprint, false);
    float opacity = s.opacity * (1.0 - s.transmission);
    bool fills = LIGHTS_FRONTS || opacity * area > 0.0;
    bool two_sided = !LIGHTS_FRONTS && (materials[t.material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    vec3 front = vec3(0.0);
    vec3 back = vec3(0.0);
#ifdef METHOD_LOBES
    if (feature(FEATURE_SPECULAR) && DIRECT != DIRECT_READ) {
        keep_no_lobe(2u * index);
        keep_no_lobe(2u * index + 1u);
    }
#endif
    uint sides = fills ? two_sided ? 2u : 1u : 0u;
    for (uint side = sides; side < 2u; side++) {
        keep_direct(2u * index + side, vec3(0.0)); // mirrors may show glass, which stores no light
    }
    for (uint side = 0u; side < sides; side++) {
        front = back;
        back = light_side(s, voxel, 2u * index + side);
        s.normal = -s.normal;
        s.facet = -s.facet;
    }
    return two_sided ? ItemLight(front, opacity, back, area) : ItemLight(back, opacity, vec3(0.0), area);
}
