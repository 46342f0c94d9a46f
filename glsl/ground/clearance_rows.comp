#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Clearance, first step: a bit per voxel that lists something.

#include "ground/constants.glsl"
#include "ground/clearance_scratch.glsl"

layout(set = 0, binding = 4, scalar) readonly buffer Heads { uint heads[]; };

void main() {
    int word = int(gl_GlobalInvocationID.x);
    if (word >= ROW_WORDS) {
        return;
    }
    uint bits = 0u;
    for (int k = 0; k < WORD_VOXELS; k++) {
        bits |= heads[word * WORD_VOXELS + k] != 0u ? 1u << uint(k) : 0u;
    }
    COUNT(HEADS, uint(WORD_VOXELS));
    scratch[word] = bits;
}
