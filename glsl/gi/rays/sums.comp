#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Sums the radiance of the lit items over blocks of each box. A thread per lit item.
#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "common/count.glsl"
#include "ground/cells.glsl"
#include "ground/light_sums.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer LitItems { uint lit_items[]; };
layout(scalar) readonly buffer SeenLights { ItemLight seen_lights[]; };

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
        add_to_block(block, sent / float(1u << 4u * number));
    }
}
