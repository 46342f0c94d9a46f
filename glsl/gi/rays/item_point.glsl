// The points at which `rays` lights list items.

#include "common/clip.glsl"
#include "common/count.glsl"
#include "ground/place_random.glsl"
#include "ground/on_plane.glsl"
#include "ground/boxes.glsl"
#include "gi/rays/sees.glsl"

const uint POINT_TRIES = 4u; // an even distribution over a part of at least a quarter of a face
// More tries if a mask leaves little, from the middle towards each corner.
const uint MASKED_TRIES = 2u * uint(PART_CORNERS);

// Whether p and q of item `index` see each other on all lit sides. Both are in voxels of its box, and n is the unit
// normal of its plane.
bool sees_beside(uint index, vec3 p, vec3 q, vec3 n) {
    ListItem entry = list_items[index];
    uint primary = item_parts[index].lit_by;
    bool two_sided = (materials[triangles[entry.triangle].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    Box box = box_of(entry.voxel);
    bool free = true;
    for (float side = two_sided ? -1.0 : 1.0; side <= 1.0; side += 2.0) {
        vec3 above = side * ray_start_in(box) * n;
        free = free && sees(entry.voxel, primary, from_box(box, p) + above, from_box(box, q) + above);
    }
    return free;
}

// Whether a mask leaves a part of an item's triangle abc at p.
bool unmasked(uint index, vec3 a, vec3 b, vec3 c, vec3 p) {
    return is_present(list_items[index].triangle, barycentric(a, b, c, p));
}

// A point of the part of triangle abc inside the voxel about `center`, evenly distributed over the region that the item
// is lit for, as far as a few tries find one. It differs in every pass, so that the mean over passes is the region's
// mean. The first pass uses the centroid of the part, or the anchor of a split item. Points that a mask cuts away are
// skipped, because no ray hits them.
vec3 item_point(uint index, vec3 a, vec3 b, vec3 c, vec3 center, vec3 middle) {
    vec3 n = triangle_normal(a, b, c);
    uvec4 seed = uvec4(uvec3(center), 0u);
    vec2 random = pass_shift() + vec2(jitter_hash(seed), jitter_hash(seed.wzyx));
    ItemPart part = item_parts[index];
    COUNT(WORDS, 6u);
    bool split = part.twin != 0u;
    vec3 anchor = split ? anchor_point(a, n, center, part.anchor) : middle;
    vec3 found = anchor;
    bool masked = feature(FEATURE_ALPHA)
        && (materials[triangles[list_items[index].triangle].material].flags & MATERIAL_MASK) != 0u;
    uint tries = frame.light_pass == 0u ? 0u : POINT_TRIES;
    bool any = masked && unmasked(index, a, b, c, anchor);
    for (uint i = 0u; i < tries; i++) {
        vec3 p = on_plane(a, n, center, fract(random + float(i) * vec2(0.618034, 0.414214)) - 0.5);
        bool inside = in_part(a, b, c, n, center, p) && (!masked || unmasked(index, a, b, c, p));
        bool better = inside && (!split || sees_beside(index, anchor, p, normalize(n)));
        found = better ? p : found;
        any = any || better;
    }
    for (uint i = 0u; i < (masked && !any ? MASKED_TRIES : 0u); i++) {
        vec3 corner;
        bool inside = part_corner(int(i) % PART_CORNERS, a - center, b - center, c - center, corner);
        vec3 p = mix(middle, center + corner, sqrt(fract(random.x + float(i) * 0.618034)));
        inside = inside && unmasked(index, a, b, c, p);
        any = inside && (!split || sees_beside(index, anchor, p, normalize(n)));
        found = any ? p : found;
    }
    return found;
}
