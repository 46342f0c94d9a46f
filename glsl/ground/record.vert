#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Record, as in the talk: an ordinary vertex shader, from object space to voxels.

#define DRAWN
#include "ground/record_draw.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec4 in_tangent;
layout(location = 3) in vec4 in_uv;
layout(location = 4) in vec4 in_color;

layout(location = 0) out vec3 out_position;
layout(location = 1) out vec3 out_normal;
layout(location = 2) out vec4 out_tangent;
layout(location = 3) out vec4 out_uv;
layout(location = 4) out vec4 out_color;

void main() {
    Corner corner = in_voxels(Corner(in_position, in_normal, in_tangent, in_uv, in_color));
    out_position = corner.position;
    out_normal = corner.normal;
    out_tangent = corner.tangent;
    out_uv = corner.uv;
    out_color = corner.color;
    // Nothing is rasterised; positions only have to be finite.
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
