// A ray that finds its triangle exactly and takes the light that the triangle itself sends there.

#include "ground/ray.glsl"

layout(set = 0, binding = 23, scalar) readonly buffer ItemParts { ItemPart item_parts[]; };
layout(set = 0, binding = 29, scalar) readonly buffer SeenLights { ItemLight seen_lights[]; }; // what list items sent one pass before

// Stored radiance of what was met, on the side that is seen: what the list item sends that stands for it where it was met.
// No other surface and no other side mixes into it, however thin a wall is.
vec3 seen_radiance(Met met) {
    COUNT(WORDS, met.any ? 4u : 0u);
    uint item = item_parts[met.item].lit_by;
    return met.back ? seen_lights[item].back : seen_lights[item].front;
}

// Leaves along unit d from a surface with normal `facet`: rgb = stored radiance of what it meets, a = 1 − what is open.
vec4 trace_light(vec3 position, vec3 facet, vec3 d) {
    // A shading normal's hemisphere reaches below the facet: what would go there is mirrored up.
    d -= 2.0 * min(dot(d, facet), 0.0) * facet;
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
