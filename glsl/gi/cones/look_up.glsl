// Method `cones`: voxel cone tracing as in the talk, with cones through the last volume that was filled.

#include "common/jitter.glsl"
#include "ground/interleave.glsl"
#include "ground/place_random.glsl"
#include "common/refraction.glsl"
#include "ground/lights.glsl"
#include "ground/brdf.glsl"
#include "ground/sky.glsl"
#include "gi/cones/cone.glsl"
#include "gi/cones/cone_set.glsl"
#include "gi/cones/roughness.glsl"

const bool FINDS_LAMPS = false;

#define METHOD_SHADOWS

// Traces a narrow cone to the light, whose shadow is soft and leaks.
float method_shadow(Light light, LightSample to, vec3 position, vec3 normal) {
    vec3 from = position + normal * cones.shadow_start_normal;
    bool far = is_far(light);
    vec3 d = far ? to.direction : light.position - from;
    float distance = far ? 1e30 : max(length(d), 1e-6);
    d = far ? d : d / distance;
    float aperture = cones.shadow_aperture >= 0.0 ? cones.shadow_aperture
        : far                                     ? light.radius
                                                  : light.radius / distance;
    float start = cones.shadow_start_along;
    if ((JITTER & 2u) != 0u) {
        // A share of the step of a cone of one voxel, by place, side, light, time and pass over the image (D9).
        uvec3 place = floatBitsToUint(position) ^ floatBitsToUint(normal)
            ^ floatBitsToUint(far ? light.direction : light.position);
        start += cones.shadow_step * fract(jitter_hash(uvec4(place, frame.turn)) + pass_shift().x);
    }
    return trace_shadow_cone(from, d, distance, aperture, start, cones.shadow_step, cones.shadow_end);
}

vec4 gather_diffuse(vec3 position, vec3 normal, uvec3 place) {
    vec3 from = position + normal * cones.diffuse_start_normal;
    mat3 basis = talk_frame(normal);
    if ((JITTER & 1u) != 0u) {
        basis = jitter_rotation(normal, fract(jitter_hash(uvec4(place, frame.turn)) + pass_shift().x)) * basis;
    }
    vec2 shift = INTERLEAVE > 1u ? interleaved_shift(place) : vec2(0.5, 0.0);
    if (INTERLEAVE > 1u && CONE_SET != COSINE_SETS) {
        basis = jitter_rotation(normal, shift.y) * basis;
    }
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < CONE_COUNT; i++) {
        Cone cone = cone_set(i, shift);
        vec3 d = basis * cone.direction;
        // The offset moves the cone's samples, but not their width.
        vec4 seen =
            trace_cone(from + cones.diffuse_offset * d, d, cone.aperture * cones.aperture, cones.diffuse_start_along);
        float open = 1.0 - min(seen.a, 1.0);
        float share =
            max(cone.aperture * cones.aperture, share_aperture(CONE_COUNT * INTERLEAVE * INTERLEAVE, cone.direction.z));
        // D21: the printed form drops alpha, and with it the sky.
        sum += cone.weight * vec4(printed(21) ? seen.rgb : seen.rgb + open * sky_about(d, share, 0.0), open);
    }
    return sum;
}

// `bright` is as for sky_about.
vec3 gather_along(vec3 from, vec3 d, float aperture, float start, float bright) {
    vec4 seen = trace_cone(from, d, aperture, start);
    return printed(21) ? seen.rgb : seen.rgb + (1.0 - min(seen.a, 1.0)) * sky_about(d, aperture, bright);
}

vec3 gather_specular(Surface s, vec3 direction, float bright) {
    return gather_along(s.position + s.normal * cones.specular_start_normal, direction,
        roughness_to_aperture(s.roughness), cones.specular_start_along, bright);
}

vec3 gather_refraction(Surface s, vec3 incident, bool back) {
    vec3 d = refraction_direction(incident, s.normal, s.ior, back, s.thickness_m <= 0.0);
    // D23: the printed form starts outside the surface that it enters. Total reflection stays on its side.
    float side = printed(23) || dot(d, s.normal) > 0.0 ? 1.0 : -1.0;
    return gather_along(s.position + side * s.normal * cones.refraction_start_normal, d,
        roughness_to_aperture(s.roughness), cones.refraction_start_along, 1.0);
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    return gather_diffuse(s.position, s.normal, place);
}

vec3 look_up_specular(Surface s) {
    return gather_specular(s, s.normal, 0.0);
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    if (feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)))) {
        sent.indirect += v.lobes.specular * gather_specular(s, mirrored(s, v.view), 1.0 - lamps_in_lobe(s.roughness));
    }
    if (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0) {
        sent.indirect += s.transmitted * v.lobes.rest * gather_refraction(s, -v.view, v.back);
    }
}
