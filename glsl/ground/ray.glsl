// A ray through the tree of all triangles, as far as it lies in the volume: exact, on any device. What it finds is what
// testing every triangle finds, to the bit, whatever the tree is like.
#include "common/count.glsl"
#include "common/color.glsl"
#include "common/hit_triangle.glsl"
#include "ground/surface.glsl"
#include "ground/boxes.glsl"
#include "ground/tree.glsl"

// How many surfaces that let a part of the light through one ray may pass.
const uint MOST_PASSED = 64u;
// Features that let a part of the light through, rather than all or nothing, as a mask does.
const uint FEATURE_PASSING = FEATURE_BLEND | FEATURE_TRANSMISSION;
const float SPENT = 0.005; // of its light: less does not change an 8-bit image

// Tests the triangle at place `triangle`.
float hit_recorded(uint triangle, vec3 origin, vec3 d, out vec2 uv) {
    COUNT(CORNERS, 3u);
    return hit_triangle(
        origin, d, triangles[triangle].corners[0], triangles[triangle].corners[1], triangles[triangle].corners[2], uv);
}

// Its material at a place on it: base colour and alpha.
vec4 triangle_color(Material m, Attributes attributes, vec2 uv, out vec4 at) {
    vec3 weights = vec3(1.0 - uv.x - uv.y, uv.x, uv.y);
    at = between(attributes.uvs, weights);
    vec4 base = base_color(m, at, between(attributes.colors, weights), POINT);
    return vec4(base.rgb, surface_alpha(m, base.a));
}

// Share of light that passes a triangle, per channel.
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

vec3 ray_start(vec3 position, vec3 facet, vec3 d) {
    float start = ray_start_at(position);
    return position + facet * (dot(facet, d) < 0.0 ? -start : start);
}

// Share of the light that comes to `origin` from `distance` voxels away along unit d. Alpha masks, blending and
// transmission let light through, straight and tinted.
vec3 trace_shadow_ray(vec3 origin, vec3 d, float distance) {
    Way w = start_way(origin, d);
    float most = min(distance, w.leave);
    bool blocked = false;
    // Optical depth in fixed point: the order of the hits cannot matter.
    uvec3 depth = uvec3(0u);
    uint tested = 0u; // triangles of the leaf at which the way stands
    for (uint k = 0u; k < 65535u && !blocked && w.node != 0u; k++) {
        // 1 + the place of a triangle that was hit and may let light through: its textures are looked at out here.
        uint passing = 0u;
        vec2 passing_uv = vec2(0.0);
        for (uint l = 0u; l < 65535u && !blocked && passing == 0u && w.node != 0u; l++) {
            uint leaf = next_leaf(w, max(w.enter, 0.0), most);
            uint count = leaf_count(leaf);
            for (; tested < count && !blocked && passing == 0u; tested++) {
                uint triangle = leaf_triangle(leaf, tested);
                uint place = max(triangle, 1u) - 1u;
                vec2 uv;
                float hit = hit_recorded(place, origin, d, uv);
                bool met = triangle != 0u && hit > 0.0 && hit < distance && hit <= w.leave;
                bool passes = met && feature(FEATURE_ALPHA) && triangles[place].translucent != 0u;
                blocked = met && !passes;
                passing = passes ? triangle : 0u;
                passing_uv = uv;
            }
            bool done = tested >= count;
            tested = done ? 0u : tested;
            pass_leaf(w, done);
        }
        if (feature(FEATURE_ALPHA)) {
            for (uint j = 0u; j < min(passing, 1u); j++) {
                vec3 passed = triangle_transmittance(passing - 1u, passing_uv);
                depth += uvec3(min(-log2(max(passed, vec3(1e-9))), vec3(31.0)) * 65536.0);
            }
        }
    }
    COUNT(RAYS_CUT, !blocked && w.node != 0u ? 1u : 0u);
    return blocked ? vec3(0.0) : mix(exp2(-vec3(depth) / 65536.0), vec3(0.0), greaterThan(depth, uvec3(29u * 65536u)));
}

struct RayHit {
    uint triangle; // 1-based; 0: nothing
    vec2 uv; // barycentric weights of b and c
    float distance;
};

// Whether a mask leaves anything of the triangle there.
bool is_present(uint triangle, vec2 uv) {
    Material m = materials[triangles[triangle].material];
    COUNT(MATERIALS, 1u);
    COUNT(TRIANGLES, 1u);
    vec4 at;
    return (m.flags & MATERIAL_MASK) == 0u || triangle_color(m, attributes_of(triangle), uv, at).a > 0.0;
}

// Tests triangle `i` of a leaf, in its turn: whether it is the nearest so far between the distances `least` and
// `leave`.
void test_nearest(uint leaf, uint i, vec3 origin, vec3 d, float least, float leave, inout uint tested,
    inout RayHit best, inout RayHit masked) {
    bool its_turn = tested == i && i < leaf_count(leaf) && masked.triangle == 0u;
    uint triangle = its_turn ? leaf_triangle(leaf, i) : 0u;
    uint place = max(triangle, 1u) - 1u;
    vec2 uv = vec2(0.0);
    float hit = -1.0;
    if (its_turn) {
        hit = hit_recorded(place, origin, d, uv);
    }
    // Equal distances: the order of the triangles is the GPU's to choose, the image must not be.
    bool nearer = hit < best.distance
        || (hit == best.distance && triangles[place].source <= triangles[max(best.triangle, 1u) - 1u].source);
    bool met = triangle != 0u && hit > least && hit <= leave && nearer;
    bool may_be_absent = feature(FEATURE_MASK) && met && triangles[place].translucent != 0u;
    RayHit found = RayHit(triangle, uv, hit);
    if (met && !may_be_absent) {
        best = found;
    }
    if (may_be_absent) {
        masked = found;
    }
    tested += its_turn ? 1u : 0u;
}

// The nearest triangle further than `least` along unit d; what a mask leaves nothing of is not there.
RayHit trace_ray(vec3 origin, vec3 d, float least) {
    RayHit best = RayHit(0u, vec2(0.0), 1e30);
    Way w = start_way(origin, d);
    float most = w.leave;
    uint tested = 0u; // triangles of the leaf at which the way stands
    for (uint k = 0u; k < 65535u && w.node != 0u; k++) {
        RayHit masked = RayHit(0u, vec2(0.0), 1e30); // would be the nearest: its textures are looked at out here
        for (uint l = 0u; l < 65535u && masked.triangle == 0u && w.node != 0u; l++) {
            // A leaf that was found stays met until all of it is tested.
            most = tested == 0u ? min(w.leave, best.distance) : most;
            uint leaf = next_leaf(w, max(w.enter, least), most);
            uint count = leaf_count(leaf); // two at most
            test_nearest(leaf, 0u, origin, d, least, w.leave, tested, best, masked);
            test_nearest(leaf, 1u, origin, d, least, w.leave, tested, best, masked);
            bool done = tested >= count;
            tested = done ? 0u : tested;
            pass_leaf(w, done);
        }
        if (feature(FEATURE_MASK)) {
            for (uint j = 0u; j < min(masked.triangle, 1u); j++) {
                if (is_present(masked.triangle - 1u, masked.uv)) {
                    best = masked;
                }
            }
        }
    }
    COUNT(RAYS_CUT, w.node != 0u ? 1u : 0u);
    return best;
}

// Surface that a ray along d hit. Where there is none, the first triangle stands in, so that all lanes read something.
struct Met {
    bool any;
    uint place; // of the triangle among those recorded
    Triangle triangle;
    vec3 weights; // barycentric
    vec3 normal; // unit, of the front
    bool back; // hit a back face
    bool dark; // hit a back face of a single-sided material
    float distance; // 0 if nothing was met
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

// Share of light that passes straight through the hit surface, per channel.
vec3 transmittance(Met met) {
    return feature(FEATURE_PASSING) && met.triangle.translucent != 0u
        ? triangle_transmittance(met.place, met.weights.yz)
        : vec3(0.0);
}

// Radiance of the lamp that is seen along unit d, with lights.lamps = sampled. Starts on the side that d leads to.
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
