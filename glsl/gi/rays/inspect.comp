#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with RAYS
// Debug views of the method. For each pixel: the cached radiance of the list item that covers its surface, and the
// item's number. With RAYS, for one pixel: the rays that gather its diffuse light, with the hit point and the radiance
// of each.

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"

layout(push_constant) uniform Push {
    uvec2 pixel; // the pixel whose rays are written
    uint scale; // side of a gathered pixel in pixels
} push;

#ifdef RAYS
layout(local_size_x = 64) in;

// Positions are in voxels of the grid; radiance is stored radiance.
struct InspectedRay {
    vec3 from;
    vec3 to;
    vec3 light;
    uint source; // 1 + the triangle that was hit first, in the scene's order; 0: none
    uint back; // 1 if it was hit from behind
};

layout(scalar) writeonly buffer InspectedRays { InspectedRay inspected[]; };
#else
layout(local_size_x = 8, local_size_y = 8) in;

layout(rgba32f) writeonly uniform image2D kept_light; // stored radiance; 1 + the item, 0 without an item
#endif

Met met_at(vec2 pixel) {
    vec2 ndc = (pixel + 0.5) / frame.image_size * 2.0 - 1.0;
    vec3 across = frame.right_per_ndc * ndc.x + frame.down_per_ndc * ndc.y;
    bool flat_view = frame.orthographic != 0u;
    vec3 d = flat_view ? frame.forward : normalize(frame.forward + across);
    return meet(trace_ray(frame.eye + (flat_view ? across : vec3(0.0)), d, 0.0), d);
}

void main() {
#ifdef RAYS
    uint i = gl_GlobalInvocationID.x;
    if (i >= DIFFUSE_RAYS) {
        return;
    }
    uvec2 place = push.pixel / push.scale;
    Met met = met_at((vec2(place) + 0.5) * float(push.scale) - 0.5); // the middle of the gathered pixel
    Surface s = evaluate_surface(met.triangle, attributes_of(met.place), met.weights, POINT, met.back);
    DiffuseRay ray = diffuse_ray(s, diffuse_frame(s, uvec3(place, 0u)), i, DIFFUSE_RAYS);
    Met first = meet(trace_ray(s.position + s.facet * ray_start_at(s.position), ray.way, 0.0), ray.way);
    float length_shown = first.any ? first.distance : float(EDGE);
    inspected[i].from = s.position;
    // No surface is visible, so nothing gathers.
    inspected[i].to = met.any ? s.position + ray.way * length_shown : s.position;
    inspected[i].light = met.any ? ray.light.rgb : vec3(0.0);
    inspected[i].source = met.any && first.any ? first.triangle.source + 1u : 0u;
    inspected[i].back = first.back ? 1u : 0u;
#else
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(kept_light)))) {
        return;
    }
    Met met = met_at(vec2(at));
    uint item = UNLIT;
    vec3 radiance = vec3(0.0);
    for (uint k = 0u; k < (met.any ? 1u : 0u); k++) { // a loop, which a CPU device leaves early
        item = lit_for(met);
        radiance = seen_radiance(met, normalize(corners_of(met.triangle) * met.weights - frame.eye));
    }
    imageStore(kept_light, at, vec4(radiance, item == UNLIT ? 0.0 : float(item) + 1.0));
#endif
}
