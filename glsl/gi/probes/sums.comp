#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Sums the light of the probes over blocks of each grid, one thread per probe. The sums are integers, so that the order
// of additions does not matter. Feedback has settled once these sums stay.
#include "common/color.glsl"
#include "common/count.glsl"
#include "gi/probes/grid.glsl"

const uint BLOCKS = 4u; // blocks along each edge; all grids add to the same blocks
const float UNITS = 64.0; // integer units per unit of stored radiance

layout(local_size_x = 64) in;

layout(scalar) readonly buffer ProbeList { Probe probes[]; };
layout(scalar) readonly buffer ProbeLight { vec4 probe_light[]; };
layout(scalar) buffer LightSums { uvec2 light_sums[]; }; // low word, high word

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
    uint units = uint(min(sum * UNITS, 4.2e9));
    uvec3 slot = uvec3(index, index / PROBE_EDGE, index / (PROBE_EDGE * PROBE_EDGE)) & (PROBE_EDGE - 1u);
    uvec3 block = slot * BLOCKS / PROBE_EDGE;
    uint place = block.x + BLOCKS * (block.y + BLOCKS * block.z);
    if (atomicAdd(light_sums[place].x, units) + units < units) {
        atomicAdd(light_sums[place].y, 1u);
    }
}
