// The lobe in which the surface of a lit item mirrors direct light. It is kept apart from what the item sends evenly: a rough floor or
// column that is lit at a grazing angle sends most of it onwards, and a ray that meets it sees that. One lobe stands for all lights: it
// comes from the mean of their directions. Held by tests/functions_rays.rs.

#include "common/numbers.glsl"

// A narrower lobe is sent evenly: the few rays that meet one would be spots. Between the two, a share of it.
const float LEAST_ITEM_ALPHA = 0.15;
const float WHOLE_ITEM_ALPHA = 0.3;

struct ItemLobe {
    vec3 light; // irradiance times f0, stored radiance
    float rise; // f90 over f0's brightest channel, 1 to 255
    vec3 toward; // where it comes from, unit
    float alpha; // of GGX
};

layout(set = 0, binding = 57, scalar) buffer ItemLobes { uvec2 item_lobes[]; }; // per list item and side

// Nine bits a channel and an exponent for all; ten bits for each coordinate of the direction on an octahedron; six for α; six for the
// logarithm of the rise.
uvec2 pack_item_lobe(ItemLobe l) {
    float most = max(l.light.r, max(l.light.g, l.light.b));
    int exponent = clamp(int(ceil(log2(max(most, 1e-30)))), -15, 16);
    uvec3 channels = min(uvec3(round(l.light * exp2(float(9 - exponent)))), uvec3(511u));
    vec3 p = l.toward / (abs(l.toward.x) + abs(l.toward.y) + abs(l.toward.z));
    vec2 side = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    uvec2 at = uvec2(round(((p.z < 0.0 ? (1.0 - abs(p.yx)) * side : p.xy) * 0.5 + 0.5) * 1023.0));
    uint alpha = uint(round(clamp(l.alpha, 0.0, 1.0) * 63.0));
    uint rise = uint(round(clamp(log2(max(l.rise, 1.0)) / 8.0, 0.0, 1.0) * 63.0));
    return uvec2(channels.r | channels.g << 9u | channels.b << 18u | uint(exponent + 15) << 27u,
        at.x | at.y << 10u | alpha << 20u | rise << 26u);
}

ItemLobe unpack_item_lobe(uvec2 packed) {
    uvec3 channels = uvec3(packed.x, packed.x >> 9u, packed.x >> 18u) & 511u;
    vec2 at = vec2(uvec2(packed.y, packed.y >> 10u) & 1023u) / 1023.0 * 2.0 - 1.0;
    float z = 1.0 - abs(at.x) - abs(at.y);
    vec2 side = vec2(at.x < 0.0 ? -1.0 : 1.0, at.y < 0.0 ? -1.0 : 1.0);
    vec3 toward = normalize(z < 0.0 ? vec3((1.0 - abs(at.yx)) * side, z) : vec3(at, z));
    return ItemLobe(vec3(channels) * exp2(float(int(packed.x >> 27u) - 15 - 9)), exp2(float(packed.y >> 26u) / 63.0 * 8.0), toward,
        float(packed.y >> 20u & 63u) / 63.0);
}

// Stored radiance that it sends along unit o from a surface with unit normal n; both o and the light are above it.
vec3 item_lobe_light(ItemLobe l, vec3 n, vec3 o) {
    vec3 h = normalize(l.toward + o);
    float nl = max(dot(n, l.toward), 1e-3);
    float no = max(dot(n, o), 1e-3);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    float a2 = l.alpha * l.alpha;
    float spread = nh * nh * (a2 - 1.0) + 1.0;
    float smith = nl * sqrt(no * no * (1.0 - a2) + a2) + no * sqrt(nl * nl * (1.0 - a2) + a2);
    float lobe = a2 / (PI * spread * spread) * 0.5 / max(smith, 1e-7);
    float grazing = 1.0 - clamp(dot(o, h), 0.0, 1.0);
    vec3 most = vec3(l.rise * max(l.light.r, max(l.light.g, l.light.b))); // at grazing incidence; white
    return mix(l.light, most, pow(grazing, 5.0)) * lobe;
}
