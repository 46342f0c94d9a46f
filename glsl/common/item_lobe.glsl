// The lobe of a surface's specular reflection of direct light in a few bits, and its radiance. One lobe represents all
// lights. Checked by tests/device/functions_geometry.rs.

#include "common/albedo.glsl"
#include "common/lobe.glsl"
#include "common/octahedron.glsl"

struct ItemLobe {
    vec3 light; // irradiance times f0, stored radiance
    float rise; // f90 over f0's brightest channel, 1 to 279
    vec3 toward; // unit direction to the light
    float alpha; // of GGX
};

const float DIELECTRIC_RISE = 25.0; // of an index of refraction of 1.5, which is represented exactly

// Bits: eight per channel, and five for a common exponent; ten for each octahedral coordinate of the direction; nine
// for α, three of them in the first word; six for the logarithm of the rise.
uvec2 pack_item_lobe(ItemLobe l) {
    int exponent = clamp(int(ceil(log2(max(brightest(l.light), 1e-30)))), -15, 16);
    uvec3 channels = min(uvec3(round(l.light * exp2(float(8 - exponent)))), uvec3(255u));
    uvec2 at = uvec2(round((octahedron_at(l.toward) * 0.5 + 0.5) * 1023.0));
    uint alpha = uint(round(clamp(l.alpha, 0.0, 1.0) * 511.0));
    uint rise = min(uint(round(log2(max(l.rise, 1.0)) * (36.0 / log2(DIELECTRIC_RISE)))), 63u);
    return uvec2(channels.r | channels.g << 8u | channels.b << 16u | uint(exponent + 15) << 24u | (alpha & 7u) << 29u,
        at.x | at.y << 10u | alpha >> 3u << 20u | rise << 26u);
}

ItemLobe unpack_item_lobe(uvec2 packed) {
    uvec3 channels = uvec3(packed.x, packed.x >> 8u, packed.x >> 16u) & 255u;
    vec2 at = vec2(uvec2(packed.y, packed.y >> 10u) & 1023u) / 1023.0 * 2.0 - 1.0;
    uint alpha = packed.x >> 29u | (packed.y >> 20u & 63u) << 3u;
    float rise = exp2(float(packed.y >> 26u) * (log2(DIELECTRIC_RISE) / 36.0));
    return ItemLobe(vec3(channels) * exp2(float(int(packed.x >> 24u & 31u) - 15 - 8)), rise,
        normalize(octahedron_point(at)), float(alpha) / 511.0);
}

// Stored radiance that a surface with unit normal n reflects along unit o; both o and the light are above the surface.
vec3 item_lobe_light(ItemLobe l, vec3 n, vec3 o) {
    vec3 h = normalize(l.toward + o);
    float nl = max(dot(n, l.toward), 1e-3);
    float no = max(dot(n, o), 1e-3);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    // Reflection is white at grazing incidence.
    return schlick(l.light, l.rise * brightest(l.light), clamp(dot(o, h), 0.0, 1.0)) * ggx_lobe(l.alpha, nh, nl, no);
}
