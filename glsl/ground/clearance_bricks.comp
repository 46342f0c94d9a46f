#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Clearance, second step: 0 for every brick with a voxel that lists something, else as far as is looked.

#include "ground/constants.glsl"
#include "ground/heads.glsl"
#include "ground/clearance_code.glsl"
#include "ground/clearance_scratch.glsl"

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= uint(BRICKS * BRICKS * BRICKS)) {
        return;
    }
    ivec3 brick = ivec3(cell_at(index, uint(BRICKS)));
    ivec3 first = brick * int(BRICK);
    uint bits = 0u;
    for (int k = 0; k < int(BRICK * BRICK); k++) {
        bits |= row_bits(first.x / WORD_VOXELS, first.y + k % int(BRICK), first.z + k / int(BRICK));
    }
    bits = bits >> uint(first.x % WORD_VOXELS) & (1u << BRICK) - 1u;
    scratch[brick_entry(0, brick)] = bits != 0u ? 0u : uint(MOST_REACH);
}
