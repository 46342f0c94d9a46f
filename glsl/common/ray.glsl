// A ray that walks the voxels (Amanatides and Woo, 1987) and tests the triangles listed in each: exact, on any device.
// Needs: surface.glsl, heads[], list_items[], globals.

#include "common/count.glsl"

// How many surfaces that let light through one ray may pass.
const uint MOST_PASSED = 8u;
const float SPENT = 0.005; // of its light: less does not change an 8-bit image
const float RAY_START = 1e-3; // voxels along the facet: 100 times the rounding of a position at edge 128

// Möller and Trumbore, both sides. Returns distance (negative: no hit), barycentric weights of b and c in `uv`.
float hit_triangle(vec3 origin, vec3 d, vec3 a, vec3 b, vec3 c, out vec2 uv) {
    vec3 e1 = b - a;
    vec3 e2 = c - a;
    vec3 p = cross(d, e2);
    float det = dot(e1, p);
    uv = vec2(0.0);
    if (det == 0.0) {
        return -1.0;
    }
    float inverse = 1.0 / det;
    vec3 s = origin - a;
    uv.x = dot(s, p) * inverse;
    vec3 q = cross(s, e1);
    uv.y = dot(d, q) * inverse;
    // A hair of tolerance: no light between two triangles that share an edge.
    if (uv.x < -1e-5 || uv.y < -1e-5 || uv.x + uv.y > 1.00001) {
        return -1.0;
    }
    return dot(e2, q) * inverse;
}

// What passes a triangle, per channel.
vec3 triangle_transmittance(Triangle t, vec2 uv) {
    Material m = materials[t.material];
    COUNT(MATERIALS, 1u);
    COUNT(TRIANGLES, 1u);
    vec3 weights = vec3(1.0 - uv.x - uv.y, uv.x, uv.y);
    Footprint sharp = Footprint(mat2[2](mat2(0.0), mat2(0.0)));
    vec4 at = triangle_uv(t, weights);
    vec4 base = base_color(m, at, triangle_color(t, weights), sharp);
    float alpha = surface_alpha(m, base.a);
    float transmission = m.transmission * (1.0 - m.metallic);
    if (has_slot(m, SLOT_TRANSMISSION)) {
        transmission *= sample_slot(m.slots[SLOT_TRANSMISSION], at, sharp, false).r;
    }
    return mix(vec3(1.0), base.rgb * transmission, alpha);
}

// Share of the light that comes from `distance` voxels away along unit d to a point on a surface with normal `facet`.
// Alpha masks, blending and transmission let light through, straight and tinted.
//
// A CPU device runs both sides of every branch and leaves only loops early: so one loop passes empty voxels, one tests a
// list, and textures are looked at outside of both, once per hit that may let light through. All rays' loops are left at
// their head alone: llvmpipe of Mesa 22.3 computes what leaves a loop elsewhere again for lanes that left before.
vec3 trace_shadow_ray(vec3 from, vec3 facet, vec3 d, float distance) {
    vec3 origin = from + facet * (dot(facet, d) < 0.0 ? -RAY_START : RAY_START);
    vec3 inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 t0 = -origin * inverse;
    vec3 t1 = (vec3(float(EDGE)) - origin) * inverse;
    vec3 near = min(t0, t1);
    vec3 far = max(t0, t1);
    float enter = max(max(near.x, max(near.y, near.z)), 0.0);
    float leave = min(min(far.x, min(far.y, far.z)), distance);
    if (enter >= leave) {
        return vec3(1.0);
    }
    ivec3 cell = clamp(ivec3(floor(origin + d * enter)), ivec3(0), ivec3(int(EDGE) - 1));
    ivec3 direction = ivec3(mix(vec3(1.0), vec3(-1.0), lessThan(d, vec3(0.0))));
    ivec3 stride = direction * ivec3(1, int(EDGE), int(EDGE * EDGE));
    vec3 next = (vec3(cell) + max(vec3(direction), vec3(0.0)) - origin) * inverse;
    vec3 delta = abs(inverse);
    int voxel = (cell.z * int(EDGE) + cell.y) * int(EDGE) + cell.x;
    float t = enter;
    float t_next = min(next.x, min(next.y, next.z));
    uint item = heads[voxel];
    COUNT(HEADS, 1u);
    bool blocked = false;
    bool walking = true;
    // Optical depth in fixed point: the order of the hits cannot matter.
    uvec3 depth = uvec3(0u);
    for (uint guard = 0u; guard < globals.item_count + 3u * EDGE && walking; guard++) {
        for (uint k = 0u; k < 3u * EDGE && item == 0u && t_next < leave; k++) {
            bvec3 axis = bvec3(next.x <= next.y && next.x <= next.z, next.y < next.x && next.y <= next.z,
                next.z < next.x && next.z < next.y);
            COUNT(RAY_STEPS, 1u);
            COUNT(HEADS, 1u);
            voxel += axis.x ? stride.x : axis.y ? stride.y : stride.z;
            next += mix(vec3(0.0), delta, axis);
            t = t_next;
            t_next = min(next.x, min(next.y, next.z));
            // Rounding may step past the last voxel just before `leave`.
            item = voxel >= 0 && voxel < int(EDGE * EDGE * EDGE) ? heads[voxel] : 0u;
        }
        uint passing = 0u; // 1 + a triangle that was hit and may let light through
        vec2 passing_uv = vec2(0.0);
        for (uint k = 0u; k < globals.item_count && item != 0u && passing == 0u; k++) {
            ListItem entry = list_items[item - 1u];
            item = entry.next;
            COUNT(LIST_ITEMS, 1u);
            COUNT(CORNERS, 3u);
            vec2 uv;
            float hit = hit_triangle(origin, d, triangles[entry.triangle].vertices[0].position,
                triangles[entry.triangle].vertices[1].position, triangles[entry.triangle].vertices[2].position, uv);
            if (hit > 0.0 && hit < distance) {
                if (!feature(FEATURE_ALPHA) || triangles[entry.triangle].translucent == 0u) {
                    blocked = true;
                    item = 0u;
                } else if (hit >= t && hit < t_next) {
                    // A triangle stands in many lists: its hit counts in the voxel where it lies.
                    passing = entry.triangle + 1u;
                    passing_uv = uv;
                }
            }
        }
        if (feature(FEATURE_ALPHA)) {
            vec3 passed = triangle_transmittance(triangles[max(passing, 1u) - 1u], passing_uv);
            uvec3 more = uvec3(min(-log2(max(passed, vec3(1e-9))), vec3(31.0)) * 65536.0);
            depth += passing != 0u ? more : uvec3(0u);
        }
        walking = !blocked && (item != 0u || t_next < leave);
    }
    return blocked ? vec3(0.0) : mix(exp2(-vec3(depth) / 65536.0), vec3(0.0), greaterThan(depth, uvec3(29u * 65536u)));
}

struct RayHit {
    uint triangle; // 1-based; 0: nothing
    vec2 uv; // barycentric weights of b and c
    float distance;
};

// The nearest triangle further than `least` along unit d.
RayHit trace_ray(vec3 origin, vec3 d, float least) {
    RayHit best = RayHit(0u, vec2(0.0), 1e30);
    vec3 inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    vec3 t0 = -origin * inverse;
    vec3 t1 = (vec3(float(EDGE)) - origin) * inverse;
    vec3 near = min(t0, t1);
    vec3 far = max(t0, t1);
    float enter = max(max(near.x, max(near.y, near.z)), least);
    float leave = min(far.x, min(far.y, far.z));
    if (enter >= leave) {
        return best;
    }
    ivec3 cell = clamp(ivec3(floor(origin + d * enter)), ivec3(0), ivec3(int(EDGE) - 1));
    ivec3 direction = ivec3(mix(vec3(1.0), vec3(-1.0), lessThan(d, vec3(0.0))));
    ivec3 stride = direction * ivec3(1, int(EDGE), int(EDGE * EDGE));
    vec3 next = (vec3(cell) + max(vec3(direction), vec3(0.0)) - origin) * inverse;
    vec3 delta = abs(inverse);
    int voxel = (cell.z * int(EDGE) + cell.y) * int(EDGE) + cell.x;
    float t_next = min(next.x, min(next.y, next.z));
    uint item = heads[voxel];
    COUNT(HEADS, 1u);
    bool walking = true;
    for (uint guard = 0u; guard < 3u * EDGE && walking; guard++) {
        for (uint k = 0u; k < 3u * EDGE && item == 0u && t_next < leave; k++) {
            bvec3 axis = bvec3(next.x <= next.y && next.x <= next.z, next.y < next.x && next.y <= next.z,
                next.z < next.x && next.z < next.y);
            COUNT(RAY_STEPS, 1u);
            COUNT(HEADS, 1u);
            voxel += axis.x ? stride.x : axis.y ? stride.y : stride.z;
            next += mix(vec3(0.0), delta, axis);
            t_next = min(next.x, min(next.y, next.z));
            // Rounding may step past the last voxel just before `leave`.
            item = voxel >= 0 && voxel < int(EDGE * EDGE * EDGE) ? heads[voxel] : 0u;
        }
        for (uint k = 0u; k < globals.item_count && item != 0u; k++) {
            COUNT(LIST_ITEMS, 1u);
            COUNT(CORNERS, 3u);
            ListItem entry = list_items[item - 1u];
            item = entry.next;
            vec2 uv;
            float hit = hit_triangle(origin, d, triangles[entry.triangle].vertices[0].position,
                triangles[entry.triangle].vertices[1].position, triangles[entry.triangle].vertices[2].position, uv);
            // Equal distances: the lists' order is the GPU's to choose, the image must not be.
            bool nearer = hit < best.distance
                || (hit == best.distance && triangles[entry.triangle].source < triangles[max(best.triangle, 1u) - 1u].source);
            if (hit > least && nearer) {
                best = RayHit(entry.triangle + 1u, uv, hit);
            }
        }
        // A triangle stands in many lists: what was hit beyond this voxel may yet be hidden.
        walking = best.distance > t_next && t_next < leave;
    }
    return best;
}

// Radiance of the lamp that is seen along unit d, with emitters = sampled. Starts on the side that d leads to.
vec3 trace_emission(vec3 position, vec3 facet, vec3 d) {
    vec3 origin = position + facet * (dot(facet, d) < 0.0 ? -RAY_START : RAY_START);
    vec3 through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_ALPHA) ? MOST_PASSED : 1u) && going; i++) {
        RayHit hit = trace_ray(origin, d, least);
        bool met = hit.triangle != 0u;
        COUNT(TRIANGLES, met ? 1u : 0u);
        COUNT(MATERIALS, met ? 1u : 0u);
        Triangle t = triangles[max(hit.triangle, 1u) - 1u];
        vec3 m = triangle_normal(t.vertices[0].position, t.vertices[1].position, t.vertices[2].position);
        vec3 weights = vec3(1.0 - hit.uv.x - hit.uv.y, hit.uv);
        Surface s = evaluate_surface(t, weights, Footprint(mat2[2](mat2(0.0), mat2(0.0))), false);
        bool shines = met && !s.unlit
            && (dot(m, d) < 0.0 || (materials[t.material].flags & MATERIAL_DOUBLE_SIDED) != 0u);
        sum += shines ? through * s.emitted * s.opacity : vec3(0.0);
        vec3 passed = feature(FEATURE_ALPHA) && t.translucent != 0u ? triangle_transmittance(t, hit.uv) : vec3(0.0);
        through *= passed;
        going = met && max(through.r, max(through.g, through.b)) >= SPENT;
        least = hit.distance;
    }
    return sum;
}
