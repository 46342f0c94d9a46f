#version 460
#extension GL_EXT_scalar_block_layout : require
#include "test/common.glsl"
#include "test/common.glsl"

layout(local_size_x = 64) in;
layout(constant_id) const uint SCALE = 1;

layout(scalar) readonly buffer Source { Item source[]; };
layout(scalar) writeonly buffer Target { uint target[]; };
layout(push_constant, scalar) uniform Push {
    uint count;
    uint add;
} push;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count)
        target[i] = SCALE * (source[i].count + uint(source[i].position.z) + uint(source[i].weights[1].y)) + push.add;
}
