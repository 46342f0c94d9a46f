#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Evaluates one function of the method `photons` at many inputs, for comparison with formulas. Not part of a frame.

#include "ground/bindings.glsl"
#include "gi/photons/cone.glsl"

layout(local_size_x = 64) in;

struct Arguments {
    vec4 a;
    vec4 b;
    vec4 c;
};

layout(scalar) readonly buffer Inputs { Arguments inputs[]; };
layout(scalar) writeonly buffer Outputs { Arguments outputs[]; };

// The order is that of `Function` in tests/common/photons.rs.
layout(constant_id) const uint FUNCTION = 0u;

layout(push_constant) uniform Push {
    uint count;
} push;

Arguments evaluate(Arguments x) {
    Arguments y = Arguments(vec4(0.0), vec4(0.0), vec4(0.0));
    if (FUNCTION == 0u) {
        y.a.xy = octahedron_place(x.a.xyz);
        y.b.xyz = normalize(octahedron_point(x.b.xy * 0.5 - 1.0));
    } else if (FUNCTION == 1u) {
        uint texel = uint(x.a.w);
        y.a = vec4(texel_middle(texel), texel_solid_angle(texel));
        y.b.xy = vec2(texel_cosine(texel, x.a.xyz), texels_total(x.a.xyz));
    } else if (FUNCTION == 2u) {
        y.a.xy = vec2(folded(ivec2(x.a.xy)));
    } else if (FUNCTION == 3u) {
        y.a.x = cone_ratio(x.a.x);
        Sphere beyond = sphere_beyond(x.a.y, x.a.z);
        Sphere after = sphere_after(Sphere(x.a.y, 2.0 * x.a.y * x.a.z), x.a.z);
        y.b = vec4(beyond.middle, beyond.extent, after.middle, after.extent);
    } else if (FUNCTION == 4u) {
        y.a.x = opacity_over(x.a.x, x.a.y, x.a.z, x.a.w);
    } else if (FUNCTION == 5u) {
        ConeLight seen = trace_cone(x.a.xyz, x.b.xyz, x.a.w);
        y.a = vec4(seen.light, seen.open);
        y.b.x = seen.near;
    }
    return y;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        outputs[i] = evaluate(inputs[i]);
    }
}
