// Rays through the tree of all triangles: exact, on any device. The results are bit-identical to testing every
// triangle, for any tree.
#include "common/count.glsl"
#include "ground/hit.glsl"
#include "ground/boxes.glsl"
#include "ground/tree.glsl"

// As trace_shadow_ray.
vec3 walk_shadow_ray(vec3 origin, vec3 d, float distance) {
    Traversal w = start_traversal(origin, d);
    float most = min(distance, w.leave);
    bool blocked = false;
    uvec3 depth = uvec3(0u);
    uint tested = 0u; // tested triangles of the current leaf
    for (uint k = 0u; k < 65535u && !blocked && w.node != 0u; k++) {
        // 1 + the index of a hit triangle that may let light through; its textures are read outside of the loop.
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
                depth += optical_depth(passed);
            }
        }
    }
    COUNT(RAYS_CUT, !blocked && w.node != 0u ? 1u : 0u);
    return blocked ? vec3(0.0) : light_after(depth);
}

// Tests triangle `i` of a leaf: whether it is the nearest so far between the distances `least` and `leave`.
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
    bool nearer = is_nearer(hit, place, best);
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

// As trace_ray.
RayHit walk_ray(vec3 origin, vec3 d, float least) {
    RayHit best = RayHit(0u, vec2(0.0), 1e30);
    Traversal w = start_traversal(origin, d);
    float most = w.leave;
    uint tested = 0u; // tested triangles of the current leaf
    for (uint k = 0u; k < 65535u && w.node != 0u; k++) {
        RayHit masked = RayHit(0u, vec2(0.0), 1e30); // its textures are read outside of the loop
        for (uint l = 0u; l < 65535u && masked.triangle == 0u && w.node != 0u; l++) {
            // A found leaf stays current until all of it is tested.
            most = tested == 0u ? min(w.leave, best.distance) : most;
            uint leaf = next_leaf(w, max(w.enter, least), most);
            uint count = leaf_count(leaf); // at most two
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
