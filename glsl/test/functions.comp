#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
// Evaluates one function of the shaders at many inputs, for comparison with its twin in tests/twins. Not part of a
// frame.

#include "common/item_lobe.glsl"
#include "common/albedo.glsl"
#include "common/clip.glsl"
#include "common/closest_point.glsl"
#include "common/fixed_sum.glsl"
#include "ground/brdf.glsl"
#include "gi/cones/look_up.glsl"
#include "ground/lamp_light.glsl"

layout(local_size_x = 64) in;

struct Arguments {
    vec4 a;
    vec4 b;
    vec4 c;
};

layout(scalar) readonly buffer Inputs { Arguments inputs[]; };
layout(scalar) writeonly buffer Outputs { Arguments outputs[]; };

// The order is that of `Function` in tests/common/functions.rs.
layout(constant_id) const uint FUNCTION = 0u;

layout(push_constant) uniform Push {
    uint count;
} push;

Arguments evaluate(Arguments x) {
    Arguments y = Arguments(vec4(0.0), vec4(0.0), vec4(0.0));
    if (FUNCTION == 0u) {
        Cone cone = cone_set(uint(x.a.x), vec2(0.5, 0.0));
        y.a = vec4(cone.direction, cone.weight);
        y.b = vec4(cone.aperture, float(CONE_COUNT), 0.0, 0.0);
    } else if (FUNCTION == 1u) {
        mat3 frame = talk_frame(x.a.xyz);
        y = Arguments(vec4(frame[0], 0.0), vec4(frame[1], 0.0), vec4(frame[2], 0.0));
    } else if (FUNCTION == 2u) {
        mat3 rotation = jitter_rotation(x.a.xyz, x.a.w);
        y = Arguments(vec4(rotation[0], 0.0), vec4(rotation[1], 0.0), vec4(rotation[2], 0.0));
    } else if (FUNCTION == 3u) {
        y.a.x = roughness_to_aperture(x.a.x);
    } else if (FUNCTION == 4u) {
        y.a.xyz = direction_weights(x.a.xyz);
        y.a.w = exit_distance(x.b.xyz, x.a.xyz);
    } else if (FUNCTION == 5u) {
        y.a.xyz = refraction_direction(x.a.xyz, x.b.xyz, x.a.w, x.b.w > 0.5, false);
    } else if (FUNCTION == 6u) {
        clip_to_voxel(x.a.xyz, x.b.xyz, x.c.xyz, vec3(x.a.w, x.b.w, x.c.w), y.a.w, y.a.xyz);
        y.b.x = float(triangle_touches_voxel(
            x.a.xyz, x.b.xyz, x.c.xyz, triangle_normal(x.a.xyz, x.b.xyz, x.c.xyz), vec3(x.a.w, x.b.w, x.c.w)));
    } else if (FUNCTION == 7u) {
        FixedSum sum = fixed_zero();
        fixed_add(sum, x.a);
        fixed_add(sum, x.b);
        fixed_add(sum, x.c);
        y.a = fixed_value(sum);
    } else if (FUNCTION == 8u) {
        y.a = trace_cone(x.a.xyz, x.b.xyz, x.a.w, x.b.w);
    } else if (FUNCTION == 9u) {
        vec3 to = x.b.xyz - x.a.xyz;
        y.a.x = trace_shadow_cone(
            x.a.xyz, to / length(to), length(to), x.a.w, cones.shadow_start_along, cones.shadow_step, cones.shadow_end);
    } else if (FUNCTION == 10u) {
        y.a = gather_diffuse(x.a.xyz, x.b.xyz, uvec3(0u));
    } else if (FUNCTION == 11u) {
        y.a.x = triangle_irradiance(x.a.xyz, x.b.xyz, x.c.xyz, normalize(vec3(x.a.w, x.b.w, x.c.w)));
    } else if (FUNCTION == 12u) {
        y.a.xy = interleaved_shift(uvec3(x.a.xyz));
    } else if (FUNCTION == 13u) {
        y.a.xyz = visible_normal(x.a.w, x.a.xyz, x.b.xy);
        y.a.w = lobe_masking(x.a.w, x.a.z);
    } else if (FUNCTION == 14u) {
        y.a.x = diffuse_share(brightest(x.b.xyz), x.b.w, x.a.x);
    } else if (FUNCTION == 15u) {
        Light light;
        light.kind = LIGHT_POINT;
        light.position = x.b.xyz;
        light.radius = 0.0;
        y.a.x = method_shadow(light, sample_light(light, x.a.xyz, 1.0), x.a.xyz, x.c.xyz);
    } else if (FUNCTION == 16u) {
        ItemLobe lobe = unpack_item_lobe(pack_item_lobe(ItemLobe(x.a.xyz, x.a.w, x.b.xyz, x.b.w)));
        y.a = vec4(lobe.light, lobe.rise);
        y.b = vec4(lobe.toward, lobe.alpha);
        y.c.xyz = item_lobe_light(lobe, vec3(0.0, 0.0, 1.0), x.c.xyz);
    } else if (FUNCTION == 17u) {
        y.a.xyz = specular_albedo(x.a.xyz, x.a.w, x.b.x, x.b.y);
    }
    return y;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        outputs[i] = evaluate(inputs[i]);
    }
}
