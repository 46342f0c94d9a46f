// Outgoing radiance of a surface that a ray met: its direct light and its reflection of the probes' light. The radiance
// is taken as equal in all directions, as for the list items of other methods.

#include "ground/brdf.glsl"
#include "ground/sent_light.glsl"
#include "gi/probes/probes_light.glsl"

vec3 direct_at(Surface s) {
    return s.unlit ? vec3(0.0) : item_direct_light(s, lobes_at(s, MEAN_COSINE), 0u);
}

// Reflected light of the probes. `view`: unit, towards the origin of the ray.
vec3 bounced_at(Surface s, vec3 view, uint bounces) {
    Lobes lobes = lobes_at(s, MEAN_COSINE);
    vec3 evenly = s.diffuse * lobes.diffuse + lobes.sheen;
    evenly += feature(FEATURE_SPECULAR) ? lobes.specular : vec3(0.0);
    vec3 sum = vec3(0.0);
    for (uint side = 0u; side < (s.unlit || bounces == 0u ? 0u : lit_sides(s)); side++) {
        Surface lit = s;
        vec3 share = evenly;
        if (side == 1u) {
            lit = far_side(s);
            share = s.finish.diffused * lobes.diffuse;
        }
        sum += share * probes_light(lit_point(lit.position, lit.normal, lit.facet, view), bounces).rgb;
    }
    return sum;
}
