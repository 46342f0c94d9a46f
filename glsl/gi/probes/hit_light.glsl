// The light that a surface sends where a ray meets it: its direct light, and what it reflects of the probes' light. As
// for the items of other methods, all of it is sent evenly.

#include "ground/brdf.glsl"
#include "ground/sent_light.glsl"
#include "gi/probes/probes_light.glsl"

vec3 direct_at(Surface s) {
    return s.unlit ? vec3(0.0) : item_direct_light(s, lobes_at(s, MEAN_COSINE), 0u);
}

// `view`: unit, towards where the surface is seen from.
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
