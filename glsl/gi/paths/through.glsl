// Transmittance between a light and a surface point: exact rays through surfaces that let a part of the light pass.

#include "gi/paths/scattering.glsl"
#include "ground/ray.glsl"

// Whether every lamp has a uniform radiance, that of its triangles: then shadow rays evaluate no material.
const bool EVEN_LAMPS = (FEATURES & (256u << SLOT_EMISSIVE | FEATURE_CLEARCOAT | FEATURE_ALPHA)) == 0u;

// The surface that a ray met, without layers on the side that faces away from the ray.
Surface surface_met(Met met, bool refracts) {
    Surface s = evaluate_surface(met.triangle, attributes_of(met.place), met.weights, POINT, met.back);
    return without_outer_layers(s, refracts, met.back);
}

// Transmittance, per channel, of a translucent surface that a ray along unit d met.
vec3 passed_straight(RayHit hit, vec3 d) {
    Met met = meet(hit, d);
    Material m = materials[met.triangle.material];
    if (feature(FEATURE_TRANSMISSION)) {
        bool refracts = is_volume(m);
        Surface s = surface_met(met, refracts);
        return mix(vec3(1.0), straight_through(s, scatterer(s, -d, refracts, refracts && met.back)), s.opacity);
    }
    vec4 at;
    return vec3(1.0 - triangle_color(m, attributes_of(met.place), hit.uv, at).a);
}

// Share of emitted light that passes the coat towards the viewer.
float coat_leaves(Surface s, vec3 view) {
    return 1.0 - coat_share(s, abs(dot(s.finish.coat_normal, view)));
}

// Emitted radiance of the surface that a ray along unit d met.
vec3 emitted_there(RayHit hit, vec3 d) {
    Met met = meet(hit, d);
    Surface s = evaluate_surface(met.triangle, attributes_of(met.place), met.weights, POINT, met.back);
    return met.dark || s.unlit ? vec3(0.0) : s.emitted * (s.opacity * coat_leaves(s, -d));
}

// Transmittance from `origin` along unit d over `distance`, in voxels. `lamp`: a lamp lies at that distance, and the
// result is its radiance times the transmittance. `even` is the radiance of the lamp's triangle.
vec3 light_through(vec3 origin, vec3 d, float distance, bool lamp, vec3 even) {
    if (EVEN_LAMPS) {
        // The ray ends just before the lamp, which is a triangle that would block it.
        return trace_shadow_ray(origin, d, lamp ? distance * 0.9999 : distance) * (lamp ? even : vec3(1.0));
    }
    const float NEAR = 1e-4; // relative rounding of the distance at which a ray meets a lamp
    float short_of = lamp ? distance * (1.0 - NEAR) - ray_start_at(origin) : distance;
    float beyond = distance * (1.0 + NEAR) + ray_start_at(origin);
    vec3 through = vec3(1.0);
    float least = 0.0;
    bool going = true;
    for (uint k = 0u; k < 65535u && going; k++) {
        RayHit hit = trace_ray(origin, d, least);
        bool met = hit.triangle != 0u && hit.distance < short_of;
        bool there = lamp && !met && hit.triangle != 0u && hit.distance < beyond;
        bool passes = met && triangles[max(hit.triangle, 1u) - 1u].translucent != 0u;
        vec3 share = lamp || met ? vec3(0.0) : vec3(1.0);
        // These loops have at most one round: a CPU device skips a loop that no lane enters.
        for (uint once = 0u; once < (passes ? 1u : 0u); once++) {
            share = passed_straight(hit, d);
        }
        for (uint once = 0u; once < (there ? 1u : 0u); once++) {
            share = emitted_there(hit, d);
        }
        through *= share;
        going = met && any(greaterThan(through, vec3(0.0)));
        least = hit.distance;
    }
    return through;
}
