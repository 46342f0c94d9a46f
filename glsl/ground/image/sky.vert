#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Sky: one triangle over the whole image, as far away as can be.
#include "ground/layout.glsl"

#include "ground/frame.glsl"

layout(location = 0) out vec3 out_way;

void main() {
    vec2 ndc = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    vec2 seen = ndc - frame.ndc_shift;
    vec3 across = frame.right_per_ndc * seen.x + frame.down_per_ndc * seen.y;
    out_way = frame.orthographic != 0u ? frame.forward : frame.forward + across;
    gl_Position = vec4(ndc, 0.0, 1.0);
}
