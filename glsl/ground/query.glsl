// Rays by VK_KHR_ray_query, through the acceleration structure of src/ground/tree/queries.rs. The device proposes
// triangles; whether one is hit, where, and through its mask is decided by the same GLSL as for rays through the tree.
#extension GL_EXT_ray_query : require
#include "common/count.glsl"
#include "ground/hit.glsl"
#include "ground/tree.glsl"

uniform accelerationStructureEXT scene_structure;

// 1 + the index of a triangle of the structure; 0 if it was dropped. The structure's first geometry holds the opaque
// triangles.
// With queries the links hold the number of opaque triangles, then all sources in the order of the structure.
uint queried(int geometry, int primitive) {
    uint first = geometry == 0 ? 1u : 1u + tree_links[0];
    return slots[tree_links[first + uint(primitive)]];
}

// The share of the light, as in trace_shadow_ray.
vec3 query_shadow_ray(vec3 origin, vec3 d, float distance) {
    Traversal w = start_traversal(origin, d);
    float least = max(w.enter, 0.0);
    float most = min(distance, w.leave);
    bool blocked = false;
    uvec3 depth = uvec3(0u);
    if (w.node != 0u && least < most) {
        uint flags = feature(FEATURE_ALPHA) ? gl_RayFlagsNoneEXT : gl_RayFlagsOpaqueEXT;
        rayQueryEXT query;
        rayQueryInitializeEXT(
            query, scene_structure, flags | gl_RayFlagsTerminateOnFirstHitEXT, 0xffu, origin, least, d, most);
        while (rayQueryProceedEXT(query)) {
            if (feature(FEATURE_ALPHA)) {
                uint triangle = queried(rayQueryGetIntersectionGeometryIndexEXT(query, false),
                    rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
                uint place = max(triangle, 1u) - 1u;
                vec2 uv;
                float hit = hit_recorded(place, origin, d, uv);
                if (triangle != 0u && hit > 0.0 && hit < distance && hit <= w.leave) {
                    depth += optical_depth(triangle_transmittance(place, uv));
                }
            }
        }
        blocked = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
    }
    return blocked ? vec3(0.0) : light_after(depth);
}

// Distances of the device and of hit_recorded differ by rounding: in voxels, and relative to the distance.
float query_rounding(float distance) {
    return 1e-4 + 1e-5 * distance;
}

// As trace_ray. The first query finds the nearest triangle according to the device. The second one examines all
// triangles at that distance within rounding, and decides like rays through the tree.
RayHit query_ray(vec3 origin, vec3 d, float least) {
    RayHit best = RayHit(0u, vec2(0.0), 1e30);
    RayHit first = best; // according to the device's test
    Traversal w = start_traversal(origin, d);
    float from = max(w.enter, least);
    float to = w.leave;
    // A ray that continues behind a triangle may meet it again within rounding.
    uint flags = least > 0.0    ? gl_RayFlagsNoOpaqueEXT
        : feature(FEATURE_MASK) ? gl_RayFlagsNoneEXT
                                : gl_RayFlagsOpaqueEXT;
    uint rounds = w.node != 0u && from < to ? 2u : 0u;
    for (uint round = 0u; round < rounds; round++) {
        rayQueryEXT query;
        rayQueryInitializeEXT(query, scene_structure, flags, 0xffu, origin, from, d, to);
        while (rayQueryProceedEXT(query)) {
            uint triangle = queried(rayQueryGetIntersectionGeometryIndexEXT(query, false),
                rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
            uint place = max(triangle, 1u) - 1u;
            vec2 uv;
            float hit = hit_recorded(place, origin, d, uv);
            bool behind = hit > 0.0 && hit <= least;
            bool met = triangle != 0u && !behind;
            if (feature(FEATURE_MASK)) {
                met = met && (triangles[place].translucent == 0u || is_present(place, uv));
            }
            if (met && round == 0u) {
                rayQueryConfirmIntersectionEXT(query);
            }
            if (met && round == 1u && hit > 0.0 && hit <= w.leave && is_nearer(hit, place, best)) {
                best = RayHit(triangle, uv, hit);
            }
        }
        bool any = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
        if (round == 0u && any) {
            float t = rayQueryGetIntersectionTEXT(query, true);
            first = RayHit(queried(rayQueryGetIntersectionGeometryIndexEXT(query, true),
                               rayQueryGetIntersectionPrimitiveIndexEXT(query, true)),
                rayQueryGetIntersectionBarycentricsEXT(query, true), t);
            from = max(from, t - query_rounding(t));
            to = min(to, t + query_rounding(t));
            flags = gl_RayFlagsNoOpaqueEXT;
        }
        rounds = any ? rounds : 0u;
    }
    // The device meets a triangle that hit_recorded misses by rounding: there is no hole.
    if (best.triangle == 0u) {
        best = first;
    }
    return best;
}
