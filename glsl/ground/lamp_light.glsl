// Light of sampled lamps on a surface (lights.lamps = sampled), for a viewer. A method whose rays find a part of the
// specular reflection of lamps defines METHOD_LAMP_SHARES and method_lamp_shares() before this file.

#include "ground/brdf.glsl"
#include "common/refraction.glsl"
#include "ground/direct_light.glsl"

struct LampLight {
    vec3 diffuse; // irradiance / π
    vec3 specular; // radiance: the share that points on lamps find
    float open; // unshadowed share of the irradiance
};

LampLight no_lamp_light() {
    return LampLight(vec3(0.0), vec3(0.0), 1.0);
}

#ifndef METHOD_LAMP_SHARES
float lamp_points_over_light(Surface s) {
    return 0.0;
}

vec2 method_lamp_shares(Surface s, Lobes lobes, vec3 view, LampPoint to, float over_light) {
    return vec2(lamps_in_lobe(s.roughness), lamps_in_lobe(s.finish.coat_roughness));
}
#endif

LampLight lamp_light(Surface s, vec3 view) {
    Lobes lobes = lobes_towards(s, view);
    vec2 random = place_random(s.position);
    LampLight sum = no_lamp_light();
    float over_light = feature(FEATURE_SPECULAR) ? lamp_points_over_light(s) : 0.0;
    float lit = 0.0;
    float unshadowed = 0.0;
    for (uint i = 0u; i < lamp_points(); i++) {
        LampPoint to = sample_lamp(i, s.position, s.normal, random);
        if (any(greaterThan(to.irradiance, vec3(0.0)))) {
            vec3 arriving = to.irradiance * shadow_towards_point(s.position, s.facet, to.point);
            sum.diffuse += arriving / PI;
            lit += brightest(arriving);
            unshadowed += brightest(to.irradiance);
            if (feature(FEATURE_SPECULAR)) {
                Brdf f = brdf(s, view, normalize(to.point - s.position));
                vec2 shares = method_lamp_shares(s, lobes, view, to, over_light);
                sum.specular += shares.x * arriving * f.specular;
                if (feature(FEATURE_LAYERS)) {
                    sum.specular += arriving * (f.sheen + shares.y * f.coat);
                }
            }
        }
    }
    sum.open = unshadowed > 0.0 ? lit / unshadowed : 1.0;
    return sum;
}

// Lamps that single rays find, for methods whose look-up does not: reflections in smooth surfaces, and light behind
// transmitting ones.
vec3 lamps_along_rays(Surface s, Viewed v) {
    vec3 sum = vec3(0.0);
    float smooth_share = 1.0 - lamps_in_lobe(s.roughness);
    bool reflects = feature(FEATURE_SPECULAR) && smooth_share > 0.0 && any(greaterThan(v.lobes.specular, vec3(0.0)));
    for (uint i = 0u; i < min(lamp_points(), reflects ? 1u : 0u); i++) {
        sum += v.lobes.specular * smooth_share * trace_emission(s.position, s.facet, mirrored(s, v.view));
    }
    bool transmits = feature(FEATURE_TRANSMISSION) && s.transmission > 0.0;
    for (uint i = 0u; i < min(lamp_points(), transmits ? 1u : 0u); i++) {
        vec3 d = refraction_direction(-v.view, s.normal, s.ior, v.back, s.thickness_m <= 0.0);
        sum += s.transmitted * v.lobes.rest * trace_emission(s.position, s.facet, d);
    }
    return sum;
}
