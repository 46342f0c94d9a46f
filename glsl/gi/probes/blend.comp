#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Brings what a probe's rays found into its texels: light by the cosine, distances by a narrow lobe. A workgroup goes
// through a probe; a thread writes a texel of light, four of distances, and their copies in the border.
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

// A back that a ray meets counts as so much nearer: a probe in a solid then hides itself.
const float BACK_SHARE = 0.2;
// Distances that say that nothing is in the way, over the spacing of probes: none asks about a point farther away than
// the diagonal of a cell and what the probe was moved.
const float MOST_DISTANCE = 2.6;

// The share of the new pass in a texel.
float new_share(uint state) {
    bool starts = push.known == 0u || (state & PROBE_FRESH) != 0u;
    return starts ? 1.0 : frame.light_pass == 0u ? 1.0 - HYSTERESIS : frame.light_share;
}

void main() {
    uint index = push.first + gl_WorkGroupID.x;
    Probe probe = probes[index];
    if (!is_active(probe)) {
        return;
    }
    float share = new_share(probe.state);
    uint rays = index * PROBE_RAYS;
    uint thread = gl_LocalInvocationID.x;
    ivec2 border[3];
    {
        uvec2 texel = uvec2(thread % LIGHT_SIDE, thread / LIGHT_SIDE);
        vec3 n = texel_way(texel, LIGHT_SIDE);
        vec4 sum = vec4(0.0);
        float total = 0.0;
        for (uint i = 0u; i < PROBE_RAYS; i++) {
            float weight = max(dot(n, probe_ways[i]), 0.0);
            sum += weight * vec4(probe_rays[rays + i].light, probe_rays[rays + i].open);
            total += weight;
        }
        COUNT(WORDS, 7u * PROBE_RAYS + 4u);
        uint first = index * LIGHT_TEXELS;
        uint place = first + texel_place(ivec2(texel), LIGHT_SIDE);
        vec4 found = total > 0.0 ? sum / total : vec4(0.0);
        found = share < 1.0 ? mix(probe_light[place], found, share) : found;
        probe_light[place] = found;
        uint copies = border_of(texel, LIGHT_SIDE, border);
        for (uint k = 0u; k < 3u; k++) {
            if ((copies & 1u << k) != 0u) {
                probe_light[first + texel_place(border[k], LIGHT_SIDE)] = found;
            }
        }
    }
    float most = MOST_DISTANCE * probe_grids[index / PROBES_PER_GRID].spacing;
    for (uint t = thread; t < DISTANCE_SIDE * DISTANCE_SIDE; t += 64u) {
        uvec2 texel = uvec2(t % DISTANCE_SIDE, t / DISTANCE_SIDE);
        vec3 n = texel_way(texel, DISTANCE_SIDE);
        vec2 sum = vec2(0.0);
        float total = 0.0;
        for (uint i = 0u; i < PROBE_RAYS; i++) {
            float weight = distance_weight(dot(n, probe_ways[i]));
            float met = probe_rays[rays + i].distance;
            float distance = min(met < 0.0 ? -BACK_SHARE * met : met, most);
            sum += weight * vec2(distance, distance * distance);
            total += weight;
        }
        COUNT(WORDS, 4u * PROBE_RAYS + 2u);
        uint first = index * DISTANCE_TEXELS;
        uint place = first + texel_place(ivec2(texel), DISTANCE_SIDE);
        // Few rays leave a texel without one near it.
        vec2 found = total > 1e-30 ? sum / total : vec2(most, most * most);
        found = share < 1.0 ? mix(probe_distances[place], found, share) : found;
        probe_distances[place] = found;
        uint copies = border_of(texel, DISTANCE_SIDE, border);
        for (uint k = 0u; k < 3u; k++) {
            if ((copies & 1u << k) != 0u) {
                probe_distances[first + texel_place(border[k], DISTANCE_SIDE)] = found;
            }
        }
    }
    barrier(); // all threads of the group have read the state
    if (thread == 0u) {
        probes[index].state = PROBE_ACTIVE;
    }
}
