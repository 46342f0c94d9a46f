#version 460
#extension GL_GOOGLE_include_directive : require
// Copies words, four per invocation: it measures the maximum rate of the device, and checks the model of fetched bytes.

#include "common/count.glsl"

layout(local_size_x = 128) in;

readonly buffer From { uvec4 from[]; };
writeonly buffer To { uvec4 to[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(from.length())) {
        COUNT(WORDS, 4u);
        to[i] = from[i];
    }
}
