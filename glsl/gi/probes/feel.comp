#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Traces the few rays by which a probe finds its place, and stores their distances. A workgroup handles one probe.
#include "ground/ray.glsl"
#include "gi/probes/feelers.glsl"
#include "gi/probes/push.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer ProbeList { Probe probes[]; };
layout(scalar) readonly buffer ProbeWays { vec3 probe_ways[]; };
layout(scalar) writeonly buffer FeltDistances { float felt_distances[]; }; // voxels; negative: the back of a surface

void main() {
    uint index = push.first + gl_WorkGroupID.y;
    uint i = gl_LocalInvocationID.x;
    Probe probe = probes[index];
    COUNT(WORDS, 10u);
    if (i >= FEELERS || !is_active(probe)) {
        return;
    }
    vec3 d = probe_ways[PROBE_RAYS + i];
    Met met = meet(trace_ray(probe.position, d, 0.0), d);
    felt_distances[index * FEELERS + i] = !met.any ? 1e30 : met.dark ? -met.distance : met.distance;
}
