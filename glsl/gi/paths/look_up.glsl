// Method `paths`: paths start at the surfaces that the image shows. Surfaces that a host drew get the same light by the
// look-ups that every method has.

#include "common/directions.glsl"
#include "gi/paths/path.glsl"
#include "ground/brdf.glsl"
#include "ground/place_random.glsl"

#define METHOD_SHADES

const bool FINDS_LAMPS = true; // paths meet lamps

// The surface point that a sample of a pixel shows.
struct SeenSurface {
    uint place; // index of its triangle among the recorded ones
    bool back; // whether the viewer sees the back
    vec3 weights; // barycentric
    vec3 view; // unit, towards the viewer
};

uvec2 path_seed(uvec2 pixel) {
    return uvec2(pixel.x | pixel.y << 16u, frame.image_pass ^ frame.turn);
}

// A random number, 0 to 4095, which chooses one of a pixel's samples.
uint method_sample(uvec2 pixel) {
    return uint(random_numbers(uvec4(path_seed(pixel), ~0u, 1u)).x * 4096.0);
}

MethodLight method_shades(SeenSurface seen, uvec2 pixel) {
    PathStart start = PathStart(true, seen.place, seen.back, seen.weights, vec3(0.0), -seen.view, 1.0);
    return follow_paths(start, path_seed(pixel));
}

// The unoccluded share of the hemisphere over a surface, estimated by one ray.
float method_open_share(Surface s, uvec2 pixel) {
    vec4 random = random_numbers(uvec4(path_seed(pixel), ~0u, 0u));
    vec3 d = tangent_frame(s.facet) * cosine_sample(random.xy);
    vec3 open = light_through(ray_start(s.position, s.facet, d), d, 1e30, false, vec3(0.0));
    return (open.r + open.g + open.b) / 3.0;
}

// The seed of a path where no pixel is known: it comes from the bits of the position.
uvec2 place_seed_of_pass(Surface s, uint look) {
    uvec3 bits = floatBitsToUint(s.position);
    return uvec2(bits.x ^ bits.z * 0x9e3779b9u, bits.y + look * 0x85ebca6bu) ^ uvec2(0u, path_seed(uvec2(0u)).y);
}

// Incoming stored radiance of a surface from unit direction d. `found` is the share of the lamps and of the bright
// part of the sky that the ray adds.
vec3 light_along(Surface s, vec3 d, float found, uvec2 seed) {
    PathStart start = PathStart(false, 0u, false, vec3(0.0), ray_start(s.position, s.facet, d), d, found);
    MethodLight light = follow_paths(start, seed);
    return (light.direct + light.indirect) * frame.scale;
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    uvec2 seed = place_seed_of_pass(s, place.x | place.y << 16u);
    vec4 random = random_numbers(uvec4(seed, ~0u, 0u));
    vec3 d = tangent_frame(s.normal) * cosine_sample(random.xy);
    return vec4(light_along(s, above_facet(d, s.facet), 0.0, seed), 1.0);
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    bool reflects = feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)));
    uvec2 seed = place_seed_of_pass(s, ~0u);
    for (uint once = 0u; once < (reflects ? 1u : 0u); once++) {
        vec4 random = random_numbers(uvec4(seed, ~0u, 1u));
        float alpha = s.roughness * s.roughness;
        mat3 basis = tangent_frame(s.normal);
        vec3 view = v.view * basis;
        view.z = max(view.z, 1e-4);
        vec3 h = alpha < MIN_ALPHA ? vec3(0.0, 0.0, 1.0) : visible_normal(alpha, view, random.xy);
        vec3 d = 2.0 * dot(view, h) * h - view;
        vec3 weight = schlick(s.f0, s.f90, clamp(dot(view, h), 0.0, 1.0)) * lobe_masking(alpha, max(d.z, 0.0));
        vec3 light = d.z > 0.0 ? light_along(s, basis * d, 1.0 - lamps_in_lobe(s.roughness), seed) : vec3(0.0);
        sent.indirect += weight * light;
    }
}
