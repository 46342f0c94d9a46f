#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Traces given rays over the lists of a frame, one per invocation, for comparison with brute force. Not part of a
// frame.

#include "ground/constants.glsl"
#include "ground/ray.glsl"

layout(local_size_x = 64) in;

// The twins of both structs are in tests/device/rays_oracle/oracle.rs.
struct Ray {
    vec3 position;
    float least;
    vec3 d; // unit
    float distance; // of the light, for shadow rays
    vec3 facet; // normal of the surface where the ray starts; 0 without a surface
};

struct Found {
    vec3 origin;
    uint source; // 1-based; 0: no hit
    vec2 uv;
    float distance;
    uint sides; // bit 0: back face, bit 1: dark
    vec3 passed; // through the triangle that was hit, or the whole way for a shadow ray
};

layout(scalar) readonly buffer Inputs { Ray inputs[]; };
layout(scalar) writeonly buffer Outputs { Found outputs[]; };

layout(constant_id) const uint SHADOW = 0u; // 1: shadow rays, else the nearest triangle

layout(push_constant) uniform Push {
    uint count;
} push;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) {
        return;
    }
    Ray ray = inputs[index];
    vec3 origin = ray_start(ray.position, ray.facet, ray.d);
    Found found = Found(origin, 0u, vec2(0.0), 0.0, 0u, vec3(0.0));
    if (SHADOW != 0u) {
        found.passed = trace_shadow_ray(origin, ray.d, ray.distance);
    } else {
        RayHit hit = trace_ray(origin, ray.d, ray.least);
        Met met = meet(hit, ray.d);
        found.source = met.any ? met.triangle.source + 1u : 0u;
        found.uv = hit.uv;
        found.distance = met.distance;
        found.sides = met.any ? (met.back ? 1u : 0u) | (met.dark ? 2u : 0u) : 0u;
        found.passed = transmittance(met);
    }
    outputs[index] = found;
}
