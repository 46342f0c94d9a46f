#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with AOVS
// Sky: what shows where there is no surface, if it is not the same all around. The other layers as where a target is
// cleared.

#include "ground/sky.glsl"

const float FAR = 1e36; // as in src/ground/image/target.rs

layout(location = 0) in vec3 in_way;

layout(location = 0) out vec4 out_beauty;
#ifdef AOVS
layout(location = 1) out vec4 out_direct;
layout(location = 2) out vec4 out_indirect;
layout(location = 3) out vec4 out_normal;
layout(location = 4) out vec4 out_albedo;
layout(location = 5) out vec4 out_ao_depth_diffuse;
#endif

void main() {
    vec4 sky = vec4(sky_towards(normalize(in_way)) / frame.scale, 0.0);
    out_beauty = sky;
#ifdef AOVS
    out_direct = sky;
    out_indirect = vec4(0.0);
    out_normal = vec4(0.0);
    out_albedo = vec4(0.0);
    out_ao_depth_diffuse = vec4(1.0, FAR, 0.0, 0.0);
#endif
}
