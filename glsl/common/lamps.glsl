// What sampled lamps give a surface (emitters = sampled), as seen by a viewer. Needs: lighting.glsl.

struct LampLight {
    vec3 diffuse; // irradiance / π
    vec3 specular; // radiance; of smooth surfaces only a part: see lamps_in_lobe
};

// Share of a lamp's reflection that points on the lamp find; the rest is one mirrored ray's, which finds all of it in what
// is smooth, where points miss the lobe.
float lamps_in_lobe(float roughness) {
    return smoothstep(0.15, 0.35, roughness);
}

LampLight lamp_light(Surface s, vec3 view) {
    vec2 random = emitter_random(s.position);
    LampLight sum = LampLight(vec3(0.0), vec3(0.0));
    for (uint i = 0u; i < emitter_samples(); i++) {
        EmitterSample to = sample_emitter(i, s.position, s.normal, random);
        if (any(greaterThan(to.irradiance, vec3(0.0)))) {
            vec3 arriving = to.irradiance * shadow_towards_point(s.position, s.facet, to.point);
            sum.diffuse += arriving / PI;
            if (feature(FEATURE_SPECULAR)) {
                sum.specular += arriving * brdf(s, view, normalize(to.point - s.position)).specular;
            }
        }
    }
    sum.specular *= lamps_in_lobe(s.roughness);
    return sum;
}

// The lamps that rays find: mirrored in what is smooth, and behind what transmits.
vec3 lamps_along_rays(Surface s, vec3 view, Lobes lobes, bool back) {
    vec3 sum = vec3(0.0);
    float mirrored = 1.0 - lamps_in_lobe(s.roughness);
    // Where a volume is there, rays for what is mirrored or seen through glass find the lamps on their way (gather_lobe.glsl).
    bool lobes_apart = BOUNCE != 0u && SPECULAR == GATHER_RAYS;
    bool glass_apart = BOUNCE != 0u && REFRACTION == GATHER_RAYS;
    bool reflects = !lobes_apart && feature(FEATURE_SPECULAR) && mirrored > 0.0 && any(greaterThan(lobes.specular, vec3(0.0)));
    for (uint i = 0u; i < min(emitter_samples(), reflects ? 1u : 0u); i++) {
        sum += lobes.specular * mirrored * trace_emission(s.position, s.facet, reflect(-view, s.normal));
    }
    bool transmits = !glass_apart && feature(FEATURE_TRANSMISSION) && s.transmission > 0.0;
    for (uint i = 0u; i < min(emitter_samples(), transmits ? 1u : 0u); i++) {
        vec3 d = refraction_direction(-view, s.normal, s.ior, back, s.thickness_m <= 0.0);
        sum += s.transmitted * lobes.rest * trace_emission(s.position, s.facet, d);
    }
    return sum;
}
