#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The radiance of the lit items, summed over blocks of each box as integers, so that the order does not matter:
// feedback has settled once these sums no longer change. A thread per lit item.
#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "common/count.glsl"
#include "ground/cells.glsl"

const uint BLOCKS = 4u; // along each edge
const float UNITS = 64.0; // per unit of stored radiance on a voxel's face

layout(local_size_x = 64) in;

layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer LitItems { uint lit_items[]; };
layout(scalar) readonly buffer SeenLights { ItemLight seen_lights[]; };
layout(scalar) buffer LightSums { uvec2 light_sums[]; }; // low word, high word

void main() {
    uint count = cell_counts[LIT_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        ItemLight light = seen_lights[lit_items[i]];
        uint voxel = list_items[lit_items[i]].voxel;
        uint number = BOXES == 0u ? 0u : voxel / (EDGE * EDGE * EDGE); // of its box
        uvec3 block = cell_at(voxel - number * (EDGE * EDGE * EDGE), EDGE) * BLOCKS / EDGE;
        COUNT(WORDS, 9u);
        COUNT(LIST_ITEMS, 1u);
        float sent = dot(light.front + light.back, vec3(light.opacity * light.area));
        // The face of a smaller voxel has a smaller weight.
        uint units = uint(min(sent * UNITS / float(1u << 4u * number), 4.2e9));
        uint place = block.x + BLOCKS * (block.y + BLOCKS * block.z);
        if (atomicAdd(light_sums[place].x, units) + units < units) {
            atomicAdd(light_sums[place].y, 1u);
        }
    }
}
