#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOBES
// Share: every gathered pixel takes the mean of its neighbours on the same surface. The square has an odd side,
// its border counts half: each of the INTERLEAVE² patterns counts the same.

#include "ground/constants.glsl"
#include "ground/layout.glsl"

#include "ground/frame.glsl"

#include "ground/image/likeness.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D surfaces;
uniform sampler2D light;
uniform sampler2D lamps;
uniform sampler2D lamps_specular;
layout(rgba16f) writeonly uniform image2D shared_light;
layout(rgba16f) writeonly uniform image2D shared_lamps;
layout(rgba16f) writeonly uniform image2D shared_lamps_specular;
#ifdef LOBES
uniform sampler2D mirrored;
layout(rgba16f) writeonly uniform image2D shared_mirrored;
#endif

layout(push_constant) uniform Push {
    uint rows; // of this band
} push;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(textureSize(light, 0).x, push.rows);
    if (any(greaterThanEqual(at, size))) {
        return;
    }
    vec4 here = texelFetch(surfaces, at, 0);
    vec3 normal = unpack_normal(max(here.w, 0.0));
    const int reach = int(INTERLEAVE / 2u);
    vec4 sum = vec4(0.0);
    vec4 lamp_sum = vec4(0.0);
    vec4 specular_sum = vec4(0.0);
    vec4 mirrored_sum = vec4(0.0);
    float total = 0.0;
    for (int y = -reach; y <= reach; y++) {
        for (int x = -reach; x <= reach; x++) {
            ivec2 to = at + ivec2(x, y);
            vec4 there = texelFetch(surfaces, clamp(to, ivec2(0), size - 1), 0);
            bool counts = all(greaterThanEqual(to, ivec2(0))) && all(lessThan(to, size)) && there.w >= 0.0;
            float border = (abs(x) == reach ? 0.5 : 1.0) * (abs(y) == reach ? 0.5 : 1.0);
            float weight =
                counts ? border * likeness(here.xyz, normal, there.xyz, unpack_normal(max(there.w, 0.0))) : 0.0;
            to = clamp(to, ivec2(0), size - 1);
            sum += weight * texelFetch(light, to, 0);
            if (LAMPS == LAMPS_SAMPLED) {
                lamp_sum += weight * texelFetch(lamps, to, 0);
                specular_sum += weight * texelFetch(lamps_specular, to, 0);
            }
#ifdef LOBES
            mirrored_sum += weight * texelFetch(mirrored, to, 0);
#endif
            total += weight;
        }
    }
    float mean = total > 0.0 ? 1.0 / total : 0.0;
    imageStore(shared_light, at, sum * mean);
#ifdef LOBES
    imageStore(shared_mirrored, at, mirrored_sum * mean);
#endif
    if (LAMPS == LAMPS_SAMPLED) {
        imageStore(shared_lamps, at, lamp_sum * mean);
        imageStore(shared_lamps_specular, at, specular_sum * mean);
    }
}
