// The lobe in which a surface mirrors direct light, as few bits, and what it sends of it. One lobe stands for all lights.
// Held by tests/functions_geometry.rs.

#include "common/lobe.glsl"
#include "common/numbers.glsl"

struct ItemLobe {
    vec3 light; // irradiance times f0, stored radiance
    float rise; // f90 over f0's brightest channel, 1 to 279
    vec3 toward; // where it comes from, unit
    float alpha; // of GGX
};

const float DIELECTRIC_RISE = 25.0; // of an index of refraction of 1.5: it comes back exactly

// Eight bits a channel and five for an exponent that all share; ten bits for each coordinate of the direction on an octahedron; nine for α,
// three of them in the first word; six for the logarithm of the rise.
uvec2 pack_item_lobe(ItemLobe l) {
    float most = max(l.light.r, max(l.light.g, l.light.b));
    int exponent = clamp(int(ceil(log2(max(most, 1e-30)))), -15, 16);
    uvec3 channels = min(uvec3(round(l.light * exp2(float(8 - exponent)))), uvec3(255u));
    vec3 p = l.toward / (abs(l.toward.x) + abs(l.toward.y) + abs(l.toward.z));
    vec2 side = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    uvec2 at = uvec2(round(((p.z < 0.0 ? (1.0 - abs(p.yx)) * side : p.xy) * 0.5 + 0.5) * 1023.0));
    uint alpha = uint(round(clamp(l.alpha, 0.0, 1.0) * 511.0));
    uint rise = min(uint(round(log2(max(l.rise, 1.0)) * (36.0 / log2(DIELECTRIC_RISE)))), 63u);
    return uvec2(channels.r | channels.g << 8u | channels.b << 16u | uint(exponent + 15) << 24u | (alpha & 7u) << 29u,
        at.x | at.y << 10u | alpha >> 3u << 20u | rise << 26u);
}

ItemLobe unpack_item_lobe(uvec2 packed) {
    uvec3 channels = uvec3(packed.x, packed.x >> 8u, packed.x >> 16u) & 255u;
    vec2 at = vec2(uvec2(packed.y, packed.y >> 10u) & 1023u) / 1023.0 * 2.0 - 1.0;
    float z = 1.0 - abs(at.x) - abs(at.y);
    vec2 side = vec2(at.x < 0.0 ? -1.0 : 1.0, at.y < 0.0 ? -1.0 : 1.0);
    vec3 toward = normalize(z < 0.0 ? vec3((1.0 - abs(at.yx)) * side, z) : vec3(at, z));
    uint alpha = packed.x >> 29u | (packed.y >> 20u & 63u) << 3u;
    float rise = exp2(float(packed.y >> 26u) * (log2(DIELECTRIC_RISE) / 36.0));
    return ItemLobe(vec3(channels) * exp2(float(int(packed.x >> 24u & 31u) - 15 - 8)), rise, toward, float(alpha) / 511.0);
}

// Stored radiance that it sends along unit o from a surface with unit normal n; both o and the light are above it.
vec3 item_lobe_light(ItemLobe l, vec3 n, vec3 o) {
    vec3 h = normalize(l.toward + o);
    float nl = max(dot(n, l.toward), 1e-3);
    float no = max(dot(n, o), 1e-3);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    float a2 = l.alpha * l.alpha;
    float spread = nh * nh * (a2 - 1.0) + 1.0;
    float lobe = a2 / (PI * spread * spread) * lobe_visibility(l.alpha, nl, no);
    float grazing = 1.0 - clamp(dot(o, h), 0.0, 1.0);
    vec3 most = vec3(l.rise * max(l.light.r, max(l.light.g, l.light.b))); // at grazing incidence; white
    return mix(l.light, most, pow(grazing, 5.0)) * lobe;
}
