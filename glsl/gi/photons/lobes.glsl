// Specular reflection of direct light by a glossy surface in a voxel: a GGX lobe about the mirrored light. One lobe
// represents all lights: its direction is the mean of theirs, and it is widened by their spread. Its light is
// distributed over the sixteen directions by averages over quarters of texels, normalised to the energy of the
// surface's lobe. Checked by tests/device/functions_photons.rs.

#include "common/lobe.glsl"
#include "ground/constants.glsl"
#include "gi/photons/octahedron.glsl"

struct LobeLight {
    vec3 light; // stored radiance of a uniform distribution, over the lobe's mean
    vec3 toward; // unit direction to the light
    float alpha;
};

layout(scalar) buffer ItemLobes { uvec4 item_lobes[]; }; // per list item and side

uvec4 pack_lobe(LobeLight l) {
    return uvec4(packHalf2x16(l.light.rg), packHalf2x16(vec2(l.light.b, l.alpha)), packHalf2x16(l.toward.xy),
        packHalf2x16(vec2(l.toward.z, 0.0)));
}

LobeLight unpack_lobe(uvec4 packed) {
    vec2 second = unpackHalf2x16(packed.y);
    return LobeLight(
        vec3(unpackHalf2x16(packed.x), second.x), vec3(unpackHalf2x16(packed.z), unpackHalf2x16(packed.w).x), second.y);
}

// Smaller half angles do not differ at the resolution of quarters of texels.
const float LEAST_LOBE_ALPHA = 0.2;

// Variances of slopes add up: those of the surface, of the lights' half vectors, and of a quarter. `mean` is the mean
// of the lights' unit directions, whose length indicates their spread.
float lobe_alpha(float roughness, vec3 mean) {
    float alpha = roughness * roughness;
    return min(sqrt(alpha * alpha + 0.5 * (1.0 - min(length(mean), 1.0)) + LEAST_LOBE_ALPHA * LEAST_LOBE_ALPHA), 1.0);
}

// The lobe times the cosine, up to a factor: D(h) G1(o).
float lobe_towards(vec3 o, vec3 n, vec3 toward, float alpha) {
    float cosine = dot(n, o);
    if (cosine <= 0.0) {
        return 0.0;
    }
    float h = dot(n, normalize(o + toward));
    float a2 = alpha * alpha;
    float spread = h * h * (a2 - 1.0) + 1.0;
    return a2 * lobe_masking(alpha, cosine) / (spread * spread);
}

vec2 lobe_quarter(vec2 at, vec3 n, vec3 toward, float alpha) {
    vec3 p = octahedron_point(at);
    float inverse = inversesqrt(dot(p, p));
    return inverse * inverse * inverse * vec2(1.0, lobe_towards(p * inverse, n, toward, alpha));
}

// The mean over a texel's solid angle.
float lobe_mean(uint texel, vec3 n, vec3 toward, float alpha) {
    vec2 corner = texel_corner(texel);
    vec2 sum = lobe_quarter(corner + vec2(0.125, 0.125), n, toward, alpha)
        + lobe_quarter(corner + vec2(0.375, 0.125), n, toward, alpha)
        + lobe_quarter(corner + vec2(0.125, 0.375), n, toward, alpha)
        + lobe_quarter(corner + vec2(0.375, 0.375), n, toward, alpha);
    return sum.y / sum.x;
}

// Light towards a texel, times the cosine; at most the largest f16.
vec3 lobe_sent(LobeLight l, uint texel, vec3 n) {
    return l.light == vec3(0.0) ? vec3(0.0)
                                : min(l.light * lobe_mean(texel, n, l.toward, l.alpha), vec3(LARGEST_STORED));
}

// `sent` is the stored radiance of a uniform distribution. `mean` is the mean of the unit directions to the lights.
LobeLight lobe_light(vec3 sent, vec3 n, vec3 mean, float roughness) {
    vec3 toward = normalize(mean);
    float alpha = lobe_alpha(roughness, mean);
    float total = 0.0;
    for (uint texel = 0u; texel < TEXELS; texel++) {
        total += texel_solid_angle(texel) * lobe_mean(texel, n, toward, alpha);
    }
    return LobeLight(sent * (PI / max(total, 1e-3)), toward, alpha);
}
