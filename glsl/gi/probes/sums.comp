#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Sums the light of the probes over blocks, which all grids share. A thread per probe.
#include "common/color.glsl"
#include "common/count.glsl"
#include "gi/probes/grid.glsl"
#include "ground/light_sums.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer ProbeList { Probe probes[]; };
layout(scalar) readonly buffer ProbeLight { vec4 probe_light[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= CASCADES * PROBES_PER_GRID || !is_active(probes[index])) {
        return;
    }
    float sum = 0.0;
    for (int k = 0; k < int(LIGHT_SIDE * LIGHT_SIDE); k++) {
        ivec2 texel = ivec2(k % int(LIGHT_SIDE), k / int(LIGHT_SIDE));
        sum += dot(probe_light[index * LIGHT_TEXELS + texel_place(texel, LIGHT_SIDE)].rgb, vec3(1.0));
    }
    COUNT(WORDS, 4u * LIGHT_SIDE * LIGHT_SIDE);
    uvec3 slot = uvec3(index, index / PROBE_EDGE, index / (PROBE_EDGE * PROBE_EDGE)) & (PROBE_EDGE - 1u);
    add_to_block(slot * BLOCKS / PROBE_EDGE, sum);
}
