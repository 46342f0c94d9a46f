#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A triangle whose lower edge ends the rows that listed fragments fill; it reaches far beyond the target's other three
// sides.

#include "ground/image/fragments.glsl"

void main() {
    uint filled = (fragment_count + push.width - 1u) / push.width;
    float end = float(filled) / float(push.rows) * 2.0 - 1.0;
    vec2 corners[3] = vec2[3](vec2(-4.0, end), vec2(4.0, end), vec2(0.0, -9.0));
    gl_Position = vec4(corners[gl_VertexIndex], 0.0, 1.0);
}
