// The light that a surface sends evenly in all directions, from lights, sampled lamps and its own emission. A method
// that keeps the direct light of specular lobes apart defines METHOD_LOBES and keep_lobe() before this file
// (ground/item_light.glsl).

#include "ground/brdf.glsl"
#include "ground/direct_light.glsl"

// Irradiance of one side by lights and sampled lamps. Its directions, weighted by brightness, are added to `toward`.
vec3 irradiance_on(Surface s, inout vec4 toward) {
    vec3 irradiance = vec3(0.0);
    for (uint i = 0u; i < frame.light_count; i++) {
        LightSample to = sample_light(lights[i], s.position, frame.voxel_m);
        float cosine = dot(s.normal, to.direction);
        if (cosine > 0.0 && any(greaterThan(to.irradiance, vec3(0.0)))) {
            vec3 lit = to.irradiance * (cosine * shadow_towards(lights[i], to, s, s.position, 0u, 1u));
            irradiance += lit;
            toward += brightest(lit) * vec4(to.direction, 1.0);
        }
    }
    vec2 random = place_random(s.position);
    for (uint i = 0u; i < lamp_points(); i++) {
        LampPoint to = sample_lamp(i, s.position, s.normal, random);
        if (any(greaterThan(to.irradiance, vec3(0.0)))) {
            vec3 lit = to.irradiance * shadow_towards_point(s.position, s.facet, to.point);
            irradiance += lit;
            toward += brightest(lit) * vec4(normalize(to.point - s.position), 1.0);
        }
    }
    return irradiance;
}

// The sides of a surface whose light is sent: its own side, and the far side if it lets light through. Loops over them
// name the light computation once, because drivers inline it at every call.
uint lit_sides(Surface s) {
    return sends_through(s) ? 2u : 1u;
}

// Stored radiance of one side from lights and sampled lamps, with its emission. `place` is that of its lobe.
vec3 item_direct_light(Surface s, Lobes lobes, uint place) {
    vec3 irradiance = vec3(0.0);
    vec3 through = vec3(0.0);
    vec4 toward = vec4(0.0);
    for (uint side = 0u; side < lit_sides(s); side++) {
        vec4 from = vec4(0.0);
        vec3 arriving = irradiance_on(side == 0u ? s : far_side(s), from);
        if (side == 0u) {
            irradiance = arriving;
            toward = from;
        } else {
            through = arriving;
        }
    }
    // Sampled lamps light every surface directly: a look-up must not find their light again.
    vec3 emitted = LAMPS == LAMPS_SAMPLED ? vec3(0.0) : s.emitted;
    vec3 specular = lobes.specular;
    if (feature(FEATURE_LAYERS)) {
        specular += lobes.sheen + lobes.coat;
        emitted *= 1.0 - lobes.coat;
    }
#ifdef METHOD_LOBES
    vec3 glossy = irradiance / PI * specular * frame.scale;
    if (feature(FEATURE_SPECULAR) && brightest(glossy) > 0.0 && dot(toward.xyz, s.facet) > 0.0) {
        specular *= 1.0 - keep_lobe(place, s, irradiance * frame.scale, glossy, toward.xyz / toward.w);
    }
#endif
    vec3 sent = irradiance / PI * (s.diffuse * lobes.diffuse + specular) + emitted;
    if (sends_through(s)) {
        sent += through / PI * (s.finish.diffused * lobes.diffuse);
    }
    return sent * frame.scale;
}
