#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Traces the rays of the probes, in equal directions for each, and stores their light and distance. With LOOK_UP the
// surfaces that they meet also reflect the light of the probes. A workgroup handles rays of one probe.
#define LIGHTS_ITEMS

#include "ground/ray.glsl"
#include "ground/sky.glsl"
#include "gi/probes/hit_light.glsl"
#include "gi/probes/push.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer ProbeWays { vec3 probe_ways[]; };
layout(scalar) buffer ProbeRays { ProbeRay probe_rays[]; };

// Tangent of the half angle of a cone that has a ray's share of the sphere.
float ray_aperture() {
    float versine = min(2.0 / float(PROBE_RAYS), 0.9);
    return sqrt(versine * (2.0 - versine)) / (1.0 - versine);
}

// Texture footprint of a ray's cone at the surface that it met.
Footprint footprint_at(Met met, Attributes attributes) {
    Footprint over = footprint_over(attributes, corners_of(met.triangle));
    float width = 2.0 * ray_aperture() * met.distance;
    return Footprint(mat2[2](width * over.uv[0], width * over.uv[1]));
}

void main() {
    uint index = push.first + gl_WorkGroupID.y;
    uint i = gl_GlobalInvocationID.x;
    Probe probe = probes[index];
    COUNT(WORDS, 7u);
    if (i >= PROBE_RAYS || !is_active(probe)) {
        return;
    }
    uint place = index * PROBE_RAYS + i;
    vec3 d = probe_ways[i];
    ProbeRay ray = ProbeRay(vec3(0.0), 0.0, 1e30);
    if (DIRECT == DIRECT_READ) {
        ray = probe_rays[place];
    }
    COUNT(WORDS, DIRECT == DIRECT_READ ? 8u : 3u);
    vec3 through = vec3(1.0);
    float least = 0.0;
    bool blocked = false;
    bool going = true;
    for (uint k = 0u; k < (feature(FEATURE_PASSING) ? MOST_PASSED : 1u) && going; k++) {
        Met met = meet(trace_ray(probe.position, d, least), d);
        vec3 passed = transmittance(met);
        bool lit = met.any && !met.dark;
        vec3 sent = vec3(0.0);
        // This loop has at most one round: a CPU device skips a loop that no lane enters.
        for (uint once = 0u; once < (lit ? 1u : 0u); once++) {
            Attributes attributes = attributes_of(met.place);
            Footprint footprint = footprint_at(met, attributes);
            Surface s = evaluate_surface(met.triangle, attributes, met.weights, footprint, met.back);
            sent = DIRECT == DIRECT_READ ? vec3(0.0) : direct_at(s);
#ifdef LOOK_UP
            sent += bounced_at(s, -d, BOUNCES);
#endif
        }
        ray.light += through * (1.0 - passed) * sent;
        if (DIRECT != DIRECT_READ) {
            // A surface that lets half of the light pass hides no probe.
            bool blocks = met.any && !blocked && brightest(passed) < 0.5;
            ray.distance = blocks ? (met.dark ? -met.distance : met.distance) : ray.distance;
            blocked = blocked || blocks;
        }
        through *= met.any ? passed : vec3(1.0);
        bool spent = brightest(through) < SPENT;
        through = spent ? vec3(0.0) : through;
        going = met.any && !spent;
        least = met.distance;
    }
    if (DIRECT != DIRECT_READ) {
        ray.light += through * sky_about(d, ray_aperture(), 0.0);
        ray.open = (through.r + through.g + through.b) / 3.0;
    }
    ray.light = clamp(ray.light, vec3(0.0), vec3(LARGEST_STORED));
    probe_rays[place] = ray;
}
