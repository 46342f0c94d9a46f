// Rays through all triangles within the volume: through the tree, or by the device's ray queries if settings and device
// allow (FEATURE_QUERY).
#include "common/count.glsl"
#include "common/color.glsl"
#include "ground/hit.glsl"
#include "ground/walk.glsl"
#include "ground/query.glsl"

// The maximum number of partly transparent surfaces that one ray may pass.
const uint MOST_PASSED = 64u;
// Features that let a part of the light through; a mask lets all or none through.
const uint FEATURE_PASSING = FEATURE_BLEND | FEATURE_TRANSMISSION;
const float SPENT = 0.005; // share of its light below which a ray ends: it cannot change an 8-bit image

vec3 ray_start(vec3 position, vec3 facet, vec3 d) {
    float start = ray_start_at(position);
    return position + facet * (dot(facet, d) < 0.0 ? -start : start);
}

// The share of light that reaches `origin` from `distance` voxels away along unit d. Alpha masks, blending and
// transmission let light through, straight and tinted.
vec3 trace_shadow_ray(vec3 origin, vec3 d, float distance) {
    if (feature(FEATURE_QUERY)) {
        return query_shadow_ray(origin, d, distance);
    }
    return walk_shadow_ray(origin, d, distance);
}

// The nearest triangle farther than `least` along unit d, without the holes of masks.
RayHit trace_ray(vec3 origin, vec3 d, float least) {
    if (feature(FEATURE_QUERY)) {
        return query_ray(origin, d, least);
    }
    return walk_ray(origin, d, least);
}

// The surface that a ray along d hit. Without a hit, the first triangle is read, so that all lanes read something.
struct Met {
    bool any;
    uint place; // index of the recorded triangle
    Triangle triangle;
    vec3 weights; // barycentric
    vec3 normal; // unit, of the front
    bool back; // hit a back face
    bool dark; // hit a back face of a single-sided material
    float distance; // 0 without a hit
};

Met meet(RayHit hit, vec3 d) {
    Met m;
    m.any = hit.triangle != 0u;
    COUNT(TRIANGLES, m.any ? 1u : 0u);
    COUNT(MATERIALS, m.any ? 1u : 0u);
    m.place = max(hit.triangle, 1u) - 1u;
    m.triangle = triangles[m.place];
    m.weights = vec3(1.0 - hit.uv.x - hit.uv.y, hit.uv);
    m.normal = normalize(triangle_normal(m.triangle.corners[0], m.triangle.corners[1], m.triangle.corners[2]));
    m.back = dot(m.normal, d) > 0.0;
    m.dark = m.back && (materials[m.triangle.material].flags & MATERIAL_DOUBLE_SIDED) == 0u;
    m.distance = m.any ? hit.distance : 0.0;
    return m;
}

// The share of light that passes straight through the hit surface, per channel.
vec3 transmittance(Met met) {
    return feature(FEATURE_PASSING) && met.triangle.translucent != 0u
        ? triangle_transmittance(met.place, met.weights.yz)
        : vec3(0.0);
}

// Radiance of the lamp along unit d, with lights.lamps = sampled. The ray starts on the side of d.
vec3 trace_emission(vec3 position, vec3 facet, vec3 d) {
    vec3 origin = ray_start(position, facet, d);
    vec3 through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_PASSING) ? MOST_PASSED : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        Surface s = evaluate_surface(met.triangle, attributes_of(met.place), met.weights, POINT, false);
        sum += met.any && !met.dark && !s.unlit ? through * s.emitted * s.opacity : vec3(0.0);
        through *= transmittance(met);
        going = met.any && brightest(through) >= SPENT;
        least = met.distance;
    }
    return sum;
}
