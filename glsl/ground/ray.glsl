// A ray that walks the voxels and tests the triangles listed in each: exact, on any device.
#include "common/count.glsl"
#include "common/color.glsl"
#include "common/hit_triangle.glsl"
#include "ground/clearance_code.glsl"
#include "ground/heads.glsl"
#include "ground/surface.glsl"

// How many surfaces that let light through one ray may pass.
const uint MOST_PASSED = 8u;
const float SPENT = 0.005; // of its light: less does not change an 8-bit image

// The same for the triangle of a list's entry.
float hit_listed(ListItem entry, vec3 origin, vec3 d, out vec2 uv) {
    COUNT(LIST_ITEMS, 1u);
    COUNT(CORNERS, 3u);
    return hit_triangle(origin, d, triangles[entry.triangle].vertices[0].position,
        triangles[entry.triangle].vertices[1].position, triangles[entry.triangle].vertices[2].position, uv);
}

// What passes a triangle, per channel.
vec3 triangle_transmittance(Triangle t, vec2 uv) {
    Material m = materials[t.material];
    COUNT(MATERIALS, 1u);
    COUNT(TRIANGLES, 1u);
    vec3 weights = vec3(1.0 - uv.x - uv.y, uv.x, uv.y);
    vec4 at = triangle_uv(t, weights);
    vec4 base = base_color(m, at, triangle_color(t, weights), POINT);
    float alpha = surface_alpha(m, base.a);
    float metallic = m.metallic;
    if (has_slot(m, SLOT_METALLIC_ROUGHNESS)) {
        metallic *= sample_slot(m.slots[SLOT_METALLIC_ROUGHNESS], at, POINT, false).b;
    }
    float transmission = m.transmission * (1.0 - metallic);
    if (has_slot(m, SLOT_TRANSMISSION)) {
        transmission *= sample_slot(m.slots[SLOT_TRANSMISSION], at, POINT, false).r;
    }
    return mix(vec3(1.0), base.rgb * transmission, alpha);
}

// A ray's way through the volume, cube by cube: a voxel that lists something, or the largest cube about an empty one that is
// known to be empty.
//
// A CPU device runs both sides of every branch and leaves only loops early: so one loop passes empty cubes, one tests a
// list, and textures are looked at outside of both, once per hit that may let light through. And it ends every loop of an
// invocation once all its loops together have gone round 65535 times (Mesa, gallivm): few rays per thread, and loops that
// are left at their heads, where nothing is pending for lanes that have left.
struct Walk {
    vec3 origin;
    vec3 d;
    vec3 inverse; // of d, with no component 0
    vec3 way; // 1 where the way leads up, else −1
    float leave; // distance at which the way ends
    vec3 voxel;
    float radius; // voxels about it that the cube takes in, on each side
    float t; // distances at which the cube is entered and left
    float t_next;
    vec3 next; // distances at which its planes ahead are met
    bool listed; // the voxel lists something that is still to be looked at
};

// Rounding may step past the last voxel just before `leave`: what is looked up there does no harm.
int walk_index(Walk w) {
    return clamp(head_index(ivec3(w.voxel)), 0, int(EDGE * EDGE * EDGE) - 1);
}

// Reads the cube about the voxel that the walk stands in.
void look_into(inout Walk w) {
    int index = walk_index(w);
    int code = clearance_code(clearance[index >> 3], index);
    COUNT(HEADS, 1u);
    w.listed = code == 0;
    w.radius = float(clear_radius(code));
    w.next = (w.voxel + 0.5 + (w.radius + 0.5) * w.way - w.origin) * w.inverse;
    w.t_next = min(w.next.x, min(w.next.y, w.next.z));
}

// Between the distances `enter` and `leave` from the origin, as far as that is in the volume.
Walk start_walk(vec3 origin, vec3 d, float enter, float leave) {
    Walk w;
    w.origin = origin;
    w.d = d;
    w.inverse = 1.0 / mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20)));
    w.way = mix(vec3(-1.0), vec3(1.0), greaterThan(w.inverse, vec3(0.0)));
    vec3 t0 = -origin * w.inverse;
    vec3 t1 = (vec3(float(EDGE)) - origin) * w.inverse;
    vec3 near = min(t0, t1);
    vec3 far = max(t0, t1);
    w.t = max(max(near.x, max(near.y, near.z)), enter);
    w.leave = min(min(far.x, min(far.y, far.z)), leave);
    w.voxel = clamp(floor(origin + d * w.t), vec3(0.0), vec3(float(EDGE) - 1.0));
    look_into(w);
    return w;
}

// To the cube about the voxel where this one is left.
void walk_on(inout Walk w) {
    vec3 within = clamp(floor(w.origin + w.d * w.t_next), w.voxel - w.radius, w.voxel + w.radius);
    w.voxel = mix(within, w.voxel + (w.radius + 1.0) * w.way, equal(w.next, vec3(w.t_next)));
    w.t = w.t_next;
    look_into(w);
}

// Distance up to which all is known.
float known(Walk w) {
    return w.listed ? w.t : w.t_next;
}

// To the next voxel with a list; there, or where the way is over, the walk ends.
void walk_to_list(inout Walk w) {
    for (uint k = 0u; k < 4u * EDGE && !w.listed && w.t_next < w.leave; k++) {
        COUNT(RAY_STEPS, 1u);
        walk_on(w);
    }
}

// The list where the walk stands, which then counts as looked at; 0 if it stands at none.
uint take_list(inout Walk w) {
    COUNT(HEADS, w.listed ? 1u : 0u);
    uint item = w.listed ? heads[walk_index(w)] : 0u;
    w.listed = false;
    return item;
}

vec3 ray_start(vec3 position, vec3 facet, vec3 d) {
    return position + facet * (dot(facet, d) < 0.0 ? -RAY_START : RAY_START);
}

// Share of the light that comes to `origin` from `distance` voxels away along unit d. Alpha masks, blending and transmission
// let light through, straight and tinted.
vec3 trace_shadow_ray(vec3 origin, vec3 d, float distance) {
    Walk w = start_walk(origin, d, 0.0, distance);
    bool blocked = false;
    bool walking = known(w) < w.leave;
    uint item = 0u;
    // Optical depth in fixed point: the order of the hits cannot matter.
    uvec3 depth = uvec3(0u);
    for (uint guard = 0u; guard < globals.item_count + 4u * EDGE && walking; guard++) {
        if (item == 0u) {
            walk_to_list(w);
            item = take_list(w);
        }
        uint passing = 0u; // 1 + a triangle that was hit and may let light through
        vec2 passing_uv = vec2(0.0);
        for (uint k = 0u; k < globals.item_count && item != 0u && passing == 0u; k++) {
            ListItem entry = list_items[item - 1u];
            item = entry.next;
            vec2 uv;
            float hit = hit_listed(entry, origin, d, uv);
            if (hit > 0.0 && hit < distance) {
                if (!feature(FEATURE_ALPHA) || triangles[entry.triangle].translucent == 0u) {
                    blocked = true;
                    item = 0u;
                } else if (hit >= w.t && hit < w.t_next) {
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
        walking = !blocked && (item != 0u || known(w) < w.leave);
    }
    return blocked ? vec3(0.0) : mix(exp2(-vec3(depth) / 65536.0), vec3(0.0), greaterThan(depth, uvec3(29u * 65536u)));
}

struct RayHit {
    uint triangle; // 1-based; 0: nothing
    uint item; // 1-based: stands for the triangle in the voxel where it was hit
    vec2 uv; // barycentric weights of b and c
    float distance;
};

// The nearest triangle further than `least` along unit d.
RayHit trace_ray(vec3 origin, vec3 d, float least) {
    RayHit best = RayHit(0u, 0u, vec2(0.0), 1e30);
    Walk w = start_walk(origin, d, least, 1e30);
    bool walking = known(w) < w.leave;
    for (uint guard = 0u; guard < 4u * EDGE && walking; guard++) {
        walk_to_list(w);
        uint item = take_list(w);
        for (uint k = 0u; k < globals.item_count && item != 0u; k++) {
            ListItem entry = list_items[item - 1u];
            vec2 uv;
            float hit = hit_listed(entry, origin, d, uv);
            // Equal distances: the lists' order is the GPU's to choose, the image must not be. The same triangle again: the
            // last voxel that lists it is the one where it was hit.
            bool nearer = hit < best.distance
                || (hit == best.distance && triangles[entry.triangle].source <= triangles[max(best.triangle, 1u) - 1u].source);
            if (hit > least && nearer) {
                best = RayHit(entry.triangle + 1u, item, uv, hit);
            }
            item = entry.next;
        }
        // A triangle stands in many lists: what was hit beyond this voxel may yet be hidden.
        walking = known(w) < min(best.distance, w.leave);
    }
    return best;
}

// What a ray along d met. Where that is nothing, the first triangle stands in, so that all lanes read something.
struct Met {
    bool any;
    Triangle triangle;
    uint item; // of the lists
    vec3 weights; // barycentric
    vec3 normal; // unit, of the front
    bool back; // is what was met,
    bool dark; // and of a material that has none
    float distance; // 0 if nothing was met
};

Met meet(RayHit hit, vec3 d) {
    Met m;
    m.any = hit.triangle != 0u;
    COUNT(TRIANGLES, m.any ? 1u : 0u);
    COUNT(MATERIALS, m.any ? 1u : 0u);
    m.triangle = triangles[max(hit.triangle, 1u) - 1u];
    m.item = max(hit.item, 1u) - 1u;
    m.weights = vec3(1.0 - hit.uv.x - hit.uv.y, hit.uv);
    m.normal = normalize(triangle_normal(m.triangle.vertices[0].position, m.triangle.vertices[1].position,
        m.triangle.vertices[2].position));
    m.back = dot(m.normal, d) > 0.0;
    m.dark = m.back && (materials[m.triangle.material].flags & MATERIAL_DOUBLE_SIDED) == 0u;
    m.distance = m.any ? hit.distance : 0.0;
    return m;
}

// What passes straight through it, per channel.
vec3 transmittance(Met met) {
    return feature(FEATURE_ALPHA) && met.triangle.translucent != 0u ? triangle_transmittance(met.triangle, met.weights.yz) : vec3(0.0);
}

// Radiance of the lamp that is seen along unit d, with lights.lamps = sampled. Starts on the side that d leads to.
vec3 trace_emission(vec3 position, vec3 facet, vec3 d) {
    vec3 origin = ray_start(position, facet, d);
    vec3 through = vec3(1.0);
    vec3 sum = vec3(0.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_ALPHA) ? MOST_PASSED : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        Surface s = evaluate_surface(met.triangle, met.weights, POINT, false);
        sum += met.any && !met.dark && !s.unlit ? through * s.emitted * s.opacity : vec3(0.0);
        through *= transmittance(met);
        going = met.any && brightest(through) >= SPENT;
        least = met.distance;
    }
    return sum;
}
