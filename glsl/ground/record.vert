#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Record: an ordinary vertex shader, object space to voxels.

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

layout(push_constant, scalar) uniform Push {
    vec4 rows[3]; // voxel_from_object
    vec3 normal_rows[3]; // its inverse transpose
    uint material;
    uint first_source;
    uint mirrored;
    uint translucent;
} push;

vec3 unit(vec3 v) {
    float l = length(v);
    return l > 0.0 ? v / l : v;
}

void main() {
    vec4 p = vec4(in_position, 1.0);
    out_position = vec3(dot(push.rows[0], p), dot(push.rows[1], p), dot(push.rows[2], p));
    out_normal = unit(vec3(
        dot(push.normal_rows[0], in_normal), dot(push.normal_rows[1], in_normal), dot(push.normal_rows[2], in_normal)));
    vec3 t = in_tangent.xyz;
    out_tangent =
        vec4(unit(vec3(dot(push.rows[0].xyz, t), dot(push.rows[1].xyz, t), dot(push.rows[2].xyz, t))), in_tangent.w);
    out_uv = in_uv;
    out_color = in_color;
    // Nothing is rasterised: positions only have to be finite.
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
