// Method `rays`: exact rays read the cached light of list items.

#include "ground/interleave.glsl"
#include "ground/place_random.glsl"
#include "gi/rays/lobes.glsl"
#include "ground/lamp_light.glsl"

const bool FINDS_LAMPS = true; // rays for reflection and transmission meet lamps

// The frame of directions that the rays of one place share.
struct DiffuseFrame {
    mat3 basis;
    vec2 shift;
};

struct DiffuseRay {
    vec3 way;
    vec4 light; // stored radiance, including the sky's; unoccluded share
};

DiffuseFrame diffuse_frame(Surface s, uvec3 place) {
    return DiffuseFrame(tangent_frame(s.normal), fract(interleaved_shift(place) + pass_shift()));
}

// Ray i of `count`.
DiffuseRay diffuse_ray(Surface s, DiffuseFrame f, uint i, uint count) {
    vec3 local = cosine_direction(i, count, f.shift);
    vec3 d = above_facet(f.basis * local, s.facet);
    vec3 through;
    vec3 seen = trace_light(s.position, s.facet, d, through);
    vec3 sky = sky_about(d, share_aperture(count * INTERLEAVE * INTERLEAVE, local.z), 0.0);
    return DiffuseRay(d, vec4(seen + through * sky, (through.r + through.g + through.b) / 3.0));
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    DiffuseFrame f = diffuse_frame(s, place);
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < DIFFUSE_RAYS; i++) {
        sum += (1.0 / float(DIFFUSE_RAYS)) * diffuse_ray(s, f, i, DIFFUSE_RAYS).light;
    }
    return sum;
}

// The number of rays of a place among crumbs.
const uint CRUMB_RAYS = DIFFUSE_RAYS / 4u + 1u;

// As look_up_diffuse. `mirrored` is the part of the rays' light that a rough lobe reflects towards `view`. `crumb`: the
// place lies among surfaces of a pixel or two, each of which would take all rays for itself.
#define METHOD_GATHERS_LOBES
vec4 look_up_for_view(Surface s, vec3 view, uvec3 place, bool crumb, out vec3 mirrored) {
    DiffuseFrame f = diffuse_frame(s, place);
    vec4 sum = vec4(0.0);
    mirrored = vec3(0.0);
    uint count = crumb ? CRUMB_RAYS : DIFFUSE_RAYS;
    for (uint i = 0u; i < count; i++) {
        DiffuseRay ray = diffuse_ray(s, f, i, count);
        sum += (1.0 / float(count)) * ray.light;
        mirrored += feature(FEATURE_SPECULAR) ? (PI / float(count)) * brdf(s, view, ray.way).specular * ray.light.rgb
                                              : vec3(0.0);
    }
    return sum;
}

// One ray of the lobe about the normal.
vec3 look_up_specular(Surface s) {
    float alpha = s.roughness * s.roughness;
    vec2 u = fract(interleaved_shift(uvec3(s.position)) + pass_shift());
    vec3 h = alpha < MIN_ALPHA ? vec3(0.0, 0.0, 1.0) : visible_normal(alpha, vec3(0.0, 0.0, 1.0), u);
    vec3 d = above_facet(tangent_frame(s.normal) * (2.0 * h.z * h - vec3(0.0, 0.0, 1.0)), s.facet);
    vec3 through;
    vec3 seen = trace_light(s.position, s.facet, d, through);
    return seen + through * sky_about(d, ggx_aperture(s.roughness), 0.0);
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    Outgoing found = look_in_lobes(s, v);
    sent.direct += found.direct;
    sent.indirect += found.indirect;
}
