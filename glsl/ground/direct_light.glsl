// Direct light on a surface with its shadows: lights, and points on sampled lamps. A method with its own shadows
// defines METHOD_SHADOWS and method_shadow() before this file.

#include "ground/place_random.glsl"
#include "ground/lights.glsl"
#include "ground/lamps.glsl"
#include "ground/ray.glsl"

// The lit share of a light's disc, by rays to points that are spread evenly over it and rotated from surface to
// surface; a single ray goes to its middle. The samples of a pixel share the points; this is one of `parts` samples.
vec3 shadow_rays(Light light, LightSample to, Surface s, vec3 position, uint part, uint parts) {
    bool far = is_far(light);
    bool soft = light.radius > 0.0 && SHADOW_RAYS > 1u;
    uint count = soft ? (SHADOW_RAYS + parts - 1u) / parts : 1u;
    vec3 x = normalize(cross(to.direction, abs(to.direction.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 y = cross(to.direction, x);
    float turn = 2.0 * PI * (jitter_hash(place_seed(s.position)) + pass_shift().x);
    vec3 open = vec3(0.0);
    for (uint k = 0u; k < count; k++) {
        float point = float(k * parts + part);
        float r = soft ? light.radius * sqrt((point + 0.5) / float(count * parts)) : 0.0;
        float angle = turn + GOLDEN_ANGLE * point;
        vec3 d = to.direction * (far ? 1.0 : to.distance) + r * (cos(angle) * x + sin(angle) * y);
        float distance = length(d);
        open += trace_shadow_ray(ray_start(position, s.facet, d), d / distance, far ? 1e30 : distance);
    }
    return open / float(count);
}

// The share of a light that reaches a point of a surface, per channel. The point is one of a pixel's `parts` samples.
vec3 shadow_towards(Light light, LightSample to, Surface s, vec3 position, uint part, uint parts) {
    if (SHADOWS == SHADOWS_RAYS) {
        return shadow_rays(light, to, s, position, part, parts);
    }
#ifdef METHOD_SHADOWS
    if (SHADOWS == SHADOWS_METHOD) {
        return vec3(method_shadow(light, to, position, s.normal));
    }
#endif
    return vec3(1.0);
}

uint lamp_points() {
    return LAMPS == LAMPS_SAMPLED && frame.lamp_count > 0u ? LAMP_POINTS : 0u;
}

vec3 shadow_towards_point(vec3 position, vec3 facet, vec3 point) {
    if (SHADOWS == SHADOWS_NONE) {
        return vec3(1.0);
    }
    vec3 origin = ray_start(position, facet, point - position);
    // The distance is not measured from the position: along a slanting ray, the origin is nearer to the lamp by more
    // than the offset.
    vec3 to = point - origin;
    float distance = length(to);
    // The ray ends before the lamp, which is listed like any triangle.
    return trace_shadow_ray(origin, to / max(distance, 1e-6), distance * 0.9999 - ray_start_at(point));
}
