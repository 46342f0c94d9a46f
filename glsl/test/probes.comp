#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Evaluates one function of the method `probes` for many inputs; tests compare the results with formulas. No frame uses
// this shader.

#include "gi/probes/feelers.glsl"
#include "gi/probes/probes_light.glsl"

layout(local_size_x = 64) in;

struct Arguments {
    vec4 a;
    vec4 b;
    vec4 c;
};

layout(scalar) readonly buffer Inputs { Arguments inputs[]; };
layout(scalar) writeonly buffer Outputs { Arguments outputs[]; };

// The order is that of `Function` in tests/device/passes_probes.rs.
layout(constant_id) const uint FUNCTION = 0u;

layout(push_constant) uniform Push {
    uint count;
} push;

Arguments evaluate(Arguments x) {
    Arguments y = Arguments(vec4(0.0), vec4(0.0), vec4(0.0));
    if (FUNCTION == 0u) {
        ivec2 border[3];
        uint copies = border_of(uvec2(x.a.xy), uint(x.a.z), border);
        y.a = vec4(texel_way(uvec2(x.a.xy), uint(x.a.z)), float(copies));
        y.b = vec4(border[0], border[1]);
        y.c.xy = vec2(border[2]);
    } else if (FUNCTION == 1u) {
        Texels t = texels_about(x.a.xyz, uint(x.a.w));
        y.a.xyz = vec3(float(t.first), t.part);
    } else if (FUNCTION == 2u) {
        y.a = vec4(distance_weight(x.a.x), facing_weight(x.a.x, x.a.z, x.a.w > 0.0), crushed(x.a.y),
            seen_weight(x.b.xy, x.b.z));
    } else if (FUNCTION == 3u) {
        y.a.xyz = vec3(cell_of(probe_of(0u, ivec3(x.a.xyz)), ivec3(x.b.xyz)));
    } else if (FUNCTION == 4u) {
        y.a = probes_light(lit_point(x.a.xyz, x.b.xyz, vec3(x.a.w, x.b.w, x.c.w), x.c.xyz), BOUNCES);
    }
    return y;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        outputs[i] = evaluate(inputs[i]);
    }
}
