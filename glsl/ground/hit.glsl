// Triangles that a ray may hit, for both tracers: ground/walk.glsl and ground/query.glsl.
#include "common/count.glsl"
#include "common/hit_triangle.glsl"
#include "ground/surface.glsl"

// Tests the triangle with index `triangle`.
float hit_recorded(uint triangle, vec3 origin, vec3 d, out vec2 uv) {
    COUNT(CORNERS, 3u);
    return hit_triangle(
        origin, d, triangles[triangle].corners[0], triangles[triangle].corners[1], triangles[triangle].corners[2], uv);
}

// The material at a point of the triangle: base colour and alpha.
vec4 triangle_color(Material m, Attributes attributes, vec2 uv, out vec4 at) {
    vec3 weights = vec3(1.0 - uv.x - uv.y, uv.x, uv.y);
    at = between(attributes.uvs, weights);
    vec4 base = base_color(m, at, between(attributes.colors, weights), POINT);
    return vec4(base.rgb, surface_alpha(m, base.a));
}

// The share of light that passes a triangle, per channel.
vec3 triangle_transmittance(uint triangle, vec2 uv) {
    Material m = materials[triangles[triangle].material];
    Attributes attributes = attributes_of(triangle);
    COUNT(MATERIALS, 1u);
    COUNT(TRIANGLES, 1u);
    vec4 at;
    vec4 base = triangle_color(m, attributes, uv, at);
    float transmission = 0.0;
    if (feature(FEATURE_TRANSMISSION)) {
        float metallic = m.metallic;
        if (has_slot(m, SLOT_METALLIC_ROUGHNESS)) {
            metallic *= sample_slot(m.slots[SLOT_METALLIC_ROUGHNESS], at, POINT, false).b;
        }
        transmission = m.transmission * (1.0 - metallic);
        if (has_slot(m, SLOT_TRANSMISSION)) {
            transmission *= sample_slot(m.slots[SLOT_TRANSMISSION], at, POINT, false).r;
        }
    }
    return mix(vec3(1.0), base.rgb * transmission, base.a);
}

// The light that passes surfaces, as optical depth in fixed point, so that the order of hits does not matter.
uvec3 optical_depth(vec3 passed) {
    return uvec3(min(-log2(max(passed, vec3(1e-9))), vec3(31.0)) * 65536.0);
}

vec3 light_after(uvec3 depth) {
    return mix(exp2(-vec3(depth) / 65536.0), vec3(0.0), greaterThan(depth, uvec3(29u * 65536u)));
}

struct RayHit {
    uint triangle; // 1-based; 0: no hit
    vec2 uv; // barycentric weights of b and c
    float distance;
};

// Whether a triangle that is hit at that distance is nearer than `best`. Ties are decided by the source, because the
// GPU determines the order of triangles, and the image must not depend on it.
bool is_nearer(float distance, uint place, RayHit best) {
    return distance < best.distance
        || (distance == best.distance && triangles[place].source <= triangles[max(best.triangle, 1u) - 1u].source);
}

// Whether a mask leaves the point of the triangle.
bool is_present(uint triangle, vec2 uv) {
    Material m = materials[triangles[triangle].material];
    COUNT(MATERIALS, 1u);
    COUNT(TRIANGLES, 1u);
    vec4 at;
    return (m.flags & MATERIAL_MASK) == 0u || triangle_color(m, attributes_of(triangle), uv, at).a > 0.0;
}
