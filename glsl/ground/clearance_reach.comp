#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Clearance, third step, axis after axis: Chebyshev distance from every brick to the nearest one with a voxel that lists
// something.

#include "ground/constants.glsl"
#include "ground/heads.glsl"
#include "ground/clearance_code.glsl"
#include "ground/clearance_scratch.glsl"

layout(push_constant) uniform Push {
    uint axis;
} push;

// Along the axes before this one; outside of the grid there is nothing.
int reach_before(ivec3 brick) {
    bool inside = all(greaterThanEqual(brick, ivec3(0))) && all(lessThan(brick, ivec3(BRICKS)));
    COUNT(WORDS, inside ? 1u : 0u);
    return inside ? int(scratch[brick_entry(int(push.axis & 1u), brick)]) : MOST_REACH;
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= uint(BRICKS * BRICKS * BRICKS)) {
        return;
    }
    ivec3 brick = ivec3(cell_at(index, uint(BRICKS)));
    ivec3 way = ivec3(equal(uvec3(push.axis), uvec3(0u, 1u, 2u)));
    int reach = reach_before(brick);
    for (int k = 1; k < reach; k++) {
        reach = min(reach, max(k, min(reach_before(brick - k * way), reach_before(brick + k * way))));
    }
    scratch[brick_entry(1 - int(push.axis & 1u), brick)] = uint(reach);
}
