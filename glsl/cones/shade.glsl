// Passes 2b and 4b, shade: lights what a list's item has of its voxel, on each side. Two forms share it: shade_raster.glsl goes
// through all voxels and fills them at once, light.glsl through the items; fill.comp then fills the occupied voxels.
// With CONES a previous bounce is gathered; without, nothing of one is even bound.

#include "common/layout.glsl"
#include "common/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/clip.glsl"
#include "common/closest_point.glsl"
#include "cones/bindings.glsl"
#ifdef CONES
#include "cones/volumes.glsl"
#endif
#include "common/texture.glsl"
#include "common/surface.glsl"
#include "common/brdf.glsl"
#include "common/lights.glsl"
#include "common/jitter.glsl"
#ifdef CONES
#include "common/cone_set.glsl"
#include "common/roughness.glsl"
#include "common/cone.glsl"
#endif
#include "common/emitters.glsl"
#include "common/ray.glsl"
#ifdef CONES
#include "common/gather_ray.glsl"
#endif
#include "common/lighting.glsl"

// A volume has no viewer: the specular lobe's albedo is taken at the mean cosine of Lambertian light, 2/3, and sent evenly.
const float MEAN_COSINE = 0.6666667;

layout(set = 0, binding = 33, scalar) buffer DirectLight { vec3 direct_light[]; }; // per list item and side, stored radiance

// Stored radiance that lights and sampled lamps make one side send, and what it emits itself.
vec3 shade_direct(Surface s, Lobes lobes) {
    vec3 irradiance = vec3(0.0);
    bool shadowed = BOUNCE != 0u || feature(FEATURE_FIRST_BOUNCE_SHADOWS);
    for (uint i = 0u; i < frame.light_count; i++) {
        LightSample to = sample_light(lights[i], s.position, frame.voxel_m);
        float cosine = dot(s.normal, to.direction);
        if (cosine > 0.0 && any(greaterThan(to.irradiance, vec3(0.0)))) {
            vec3 open = shadowed ? shadow_towards(lights[i], to, s.position, s.facet, s.normal, BOUNCE != 0u) : vec3(1.0);
            irradiance += to.irradiance * (cosine * open);
        }
    }
    vec2 random = emitter_random(s.position);
    for (uint i = 0u; i < emitter_samples(); i++) {
        EmitterSample to = sample_emitter(i, s.position, s.normal, random);
        if (any(greaterThan(to.irradiance, vec3(0.0)))) {
            irradiance += to.irradiance * (shadowed ? shadow_towards_point(s.position, s.facet, to.point) : vec3(1.0));
        }
    }
    // Sampled lamps light every surface there and then: whoever gathers must not find their light again.
    vec3 emitted = EMITTERS == EMITTERS_SAMPLED ? vec3(0.0) : s.emitted;
    return (irradiance / PI * (s.diffuse * lobes.diffuse + lobes.specular) + emitted) * frame.scale;
}

// What one side sends: stored radiance, not yet times opacity. `place`: among the direct lights.
vec3 shade_side(Surface s, uvec3 voxel, uint place) {
    if (s.unlit) {
        return vec3(0.0); // neither lit nor lighting
    }
    Lobes lobes = lobes_at(s, MEAN_COSINE);
    vec3 stored;
    if (DIRECT == DIRECT_READ) {
        COUNT(WORDS, 3u);
        stored = direct_light[place];
    } else {
        stored = shade_direct(s, lobes);
    }
    if (DIRECT == DIRECT_KEEP) {
        direct_light[place] = stored;
    }
#ifdef CONES
    vec3 diffuse = s.diffuse * lobes.diffuse;
    if (any(greaterThan(diffuse, vec3(0.0)))) {
        stored += diffuse * gather_diffuse(s.position, s.facet, s.normal, voxel).rgb;
    }
    if (feature(FEATURE_SPECULAR) && any(greaterThan(lobes.specular, vec3(0.0)))) {
        stored += lobes.specular * gather_specular(s.position, s.normal, s.normal, s.roughness);
    }
#endif
    return clamp(stored, vec3(0.0), vec3(LARGEST_STORED));
}

// The triangle of item `index` of the lists, cut to its voxel and lit on each of its sides.
ItemLight shade_item(uint index, Triangle t, uvec3 voxel) {
    COUNT(LIST_ITEMS, 1u);
    COUNT(TRIANGLES, 1u);
    vec3 a = t.vertices[0].position;
    vec3 b = t.vertices[1].position;
    vec3 c = t.vertices[2].position;
    vec3 center = vec3(voxel) + 0.5;
    float area = 1.0;
    vec2 bc;
    if (FILL >= FILL_COVERAGE) { // and sided
        vec3 middle;
        clip_to_voxel(a, b, c, center, area, middle);
        bc = area > 0.0 ? barycentric(a, b, c, middle) : vec2(0.0);
    } else {
        bc = closest_point(a, b, c, center);
    }
    Surface s = evaluate_surface(t, vec3(1.0 - bc.x - bc.y, bc), voxel_footprint(t), false);
    float opacity = s.opacity * (1.0 - s.transmission);
    bool fills = FILL == FILL_UNIFORM || opacity * area > 0.0;
    bool two_sided = (materials[t.material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    vec3 front = vec3(0.0);
    vec3 back = vec3(0.0);
    for (uint side = 0u; side < (fills ? two_sided ? 2u : 1u : 0u); side++) {
        front = back;
        back = shade_side(s, voxel, 2u * index + side);
        s.normal = -s.normal;
        s.facet = -s.facet;
    }
    return two_sided ? ItemLight(front, opacity, back, area) : ItemLight(back, opacity, vec3(0.0), area);
}
