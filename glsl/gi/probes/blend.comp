#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Filters the rays of a probe into its texels: light by the cosine, distances by a narrow lobe. A workgroup handles one
// probe. A thread writes one texel of light, four texels of distances, and their copies in the border.
#include "common/count.glsl"
#include "ground/frame.glsl"
#include "gi/probes/grid.glsl"
#include "gi/probes/weights.glsl"
#include "gi/probes/push.glsl"

layout(local_size_x = 64) in;

layout(scalar) buffer ProbeList { Probe probes[]; };
layout(scalar) readonly buffer ProbeGrids { ProbeGrid probe_grids[]; };
layout(scalar) readonly buffer ProbeWays { vec3 probe_ways[]; };
layout(scalar) readonly buffer ProbeRays { ProbeRay probe_rays[]; };
layout(scalar) buffer ProbeDistances { vec2 probe_distances[]; };
layout(scalar) buffer ProbeLight { vec4 probe_light[]; };

// Factor of the distance of a hit on a back face: a probe within a solid then hides itself.
const float BACK_SHARE = 0.2;
// The largest stored distance, in spacings of probes. No look-up asks for more than a cell's diagonal plus the probe's
// offset.
const float MOST_DISTANCE = 2.6;

// Weight of the new pass in a texel, 0 to 1.
float new_share(uint state) {
    bool starts = push.known == 0u || (state & PROBE_FRESH) != 0u;
    return starts ? 1.0 : frame.light_pass > 0u ? frame.light_share : push.known == 2u ? 1.0 : 1.0 - HYSTERESIS;
}

// Texels of distances per thread.
const uint DISTANCES = DISTANCE_SIDE * DISTANCE_SIDE / 64u;

uvec2 distance_texel(uint thread, uint k) {
    uint t = 64u * k + thread;
    return uvec2(t % DISTANCE_SIDE, t / DISTANCE_SIDE);
}

// Writes a texel of the map that begins at index `first`, and the texel's copies in the border.
void keep_light(uint first, uvec2 texel, vec4 found, float share) {
    uint place = first + texel_place(ivec2(texel), LIGHT_SIDE);
    COUNT(WORDS, share < 1.0 ? 4u : 0u);
    found = share < 1.0 ? mix(probe_light[place], found, share) : found;
    probe_light[place] = found;
    ivec2 border[3];
    uint copies = border_of(texel, LIGHT_SIDE, border);
    for (uint k = 0u; k < 3u; k++) {
        if ((copies & 1u << k) != 0u) {
            probe_light[first + texel_place(border[k], LIGHT_SIDE)] = found;
        }
    }
}

void keep_distances(uint first, uvec2 texel, vec2 found, float share) {
    uint place = first + texel_place(ivec2(texel), DISTANCE_SIDE);
    COUNT(WORDS, share < 1.0 ? 2u : 0u);
    found = share < 1.0 ? mix(probe_distances[place], found, share) : found;
    probe_distances[place] = found;
    ivec2 border[3];
    uint copies = border_of(texel, DISTANCE_SIDE, border);
    for (uint k = 0u; k < 3u; k++) {
        if ((copies & 1u << k) != 0u) {
            probe_distances[first + texel_place(border[k], DISTANCE_SIDE)] = found;
        }
    }
}

void main() {
    uint index = push.first + gl_WorkGroupID.x;
    Probe probe = probes[index];
    if (!is_active(probe)) {
        return;
    }
    float share = new_share(probe.state);
    bool lights_alone = push.step == 1u; // the distances of an earlier pass over the same rays stay
    float most = MOST_DISTANCE * probe_grids[index / PROBES_PER_GRID].spacing;
    uint thread = gl_LocalInvocationID.x;
    uvec2 light_texel = uvec2(thread % LIGHT_SIDE, thread / LIGHT_SIDE);
    vec3 n = texel_way(light_texel, LIGHT_SIDE);
    vec3 distance_ways[DISTANCES];
    for (uint k = 0u; k < DISTANCES; k++) {
        distance_ways[k] = texel_way(distance_texel(thread, k), DISTANCE_SIDE);
    }
    vec4 light = vec4(0.0);
    float total = 0.0;
    vec3 distances[DISTANCES]; // sums of distances, of their squares, of weights
    for (uint k = 0u; k < DISTANCES; k++) {
        distances[k] = vec3(0.0);
    }
    for (uint i = 0u; i < PROBE_RAYS; i++) {
        vec3 way = probe_ways[i];
        ProbeRay ray = probe_rays[index * PROBE_RAYS + i];
        float weight = max(dot(n, way), 0.0);
        light += weight * vec4(ray.light, ray.open);
        total += weight;
        float met = min(ray.distance < 0.0 ? -BACK_SHARE * ray.distance : ray.distance, most);
        for (uint k = 0u; k < (lights_alone ? 0u : DISTANCES); k++) {
            distances[k] += distance_weight(dot(distance_ways[k], way)) * vec3(met, met * met, 1.0);
        }
    }
    COUNT(WORDS, 8u * PROBE_RAYS);
    light = total > 0.0 ? light / total : vec4(0.0);
    keep_light(index * LIGHT_TEXELS, light_texel, light, share);
    for (uint k = 0u; k < (lights_alone ? 0u : DISTANCES); k++) {
        // Where rays are few, a texel may have no ray near its direction.
        vec2 found = distances[k].z > 1e-30 ? distances[k].xy / distances[k].z : vec2(most, most * most);
        keep_distances(index * DISTANCE_TEXELS, distance_texel(thread, k), found, share);
    }
    barrier(); // all threads of the group have read the state
    if (thread == 0u) {
        probes[index].state = PROBE_ACTIVE;
    }
}
