#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 5a, gather: diffuse light of what is seen, at fewer pixels than the image has, each looking along directions of its
// own. Pass 5b shares it, pass 5 brings it up to the image.
#define CONES

#include "common/layout.glsl"
#include "common/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/closest_point.glsl"
#include "cones/bindings.glsl"
#include "cones/volumes.glsl"
#include "common/texture.glsl"
#include "common/surface.glsl"
#include "common/brdf.glsl"
#include "common/lights.glsl"
#include "common/jitter.glsl"
#include "common/cone_set.glsl"
#include "common/roughness.glsl"
#include "common/cone.glsl"
#include "common/emitters.glsl"
#include "common/ray.glsl"
#include "common/gather_ray.glsl"
#include "common/lighting.glsl"
#include "common/lamps.glsl"
#include "common/likeness.glsl"
#include "common/footprint.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the gathered pixels, at the top of this band
} push;

layout(early_fragment_tests) in; // depth is there already

layout(location = 0) in vec3 in_weights;
layout(location = 2) flat in uint in_triangle;
layout(location = 3) flat in uint in_back;

layout(location = 0) out vec4 out_surface; // position, voxels; packed normal, −1 where nothing gathers
layout(location = 1) out vec4 out_light; // E/π in stored radiance; open share of the hemisphere
layout(location = 2) out vec4 out_lamps; // the same of sampled lamps
layout(location = 3) out vec4 out_lamps_specular; // stored radiance

void main() {
    COUNT(TRIANGLES, 1u);
    COUNT(MATERIALS, 1u);
    Triangle t = triangles[in_triangle];
    vec3 weights = in_weights / (in_weights.x + in_weights.y + in_weights.z);
    Surface s = evaluate_surface(t, weights, pixel_footprint(t, in_weights), in_back != 0u);
    vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
    vec4 light = vec4(0.0);
    LampLight lamps = LampLight(vec3(0.0), vec3(0.0));
    // Metals, glass and unlit surfaces gather nothing: a loop, which a CPU device leaves early.
    for (uint i = 0u; i < (any(greaterThan(s.diffuse, vec3(0.0))) ? 1u : 0u); i++) {
        uvec2 pixel = uvec2(gl_FragCoord.xy) + uvec2(0u, push.first_row);
        light = gather_diffuse(s.position, s.facet, s.normal, uvec3(pixel, 0u));
        lamps = lamp_light(s, view);
    }
    out_surface = vec4(s.position, any(greaterThan(s.diffuse, vec3(0.0))) ? pack_normal(s.normal) : -1.0);
    out_light = light;
    out_lamps = vec4(min(lamps.diffuse * frame.scale, LARGEST_STORED), 0.0);
    out_lamps_specular = vec4(min(lamps.specular * frame.scale, LARGEST_STORED), 0.0);
}
