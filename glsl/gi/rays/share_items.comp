#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with FEEDBACK
// The radiance of each lit item as others see it: the mean of what it and its neighbours on the same surface send,
// since each looks along other directions. Directions differ within squares of four voxels (image.interleave); a square
// of five whose border counts half has each of them once, so that no pattern is left where few directions meet
// something bright. Where a voxel lists anything else beside, nothing is shared with it or across it: the surface may
// end there at a wall, and no light may pass that. A mean of many passes looks along many directions itself, and
// sharing only blurs it: neighbours count by the square of what one pass is of the mean (a corridor at 64³, `balanced`:
// energy 1.024 to 1.014; elsewhere up to 3 % more noise). Not where there are boxes of finer voxels, although a
// corridor at 32³ has 1.08 for that and would have 1.05: each time that one moves with the camera a mean begins anew,
// and what is blurred then would not be soon after. A thread per lit item. With FEEDBACK, what the next pass reads is
// handed over to it. That is what items send themselves, once a mean of passes is made: what was shared in every pass
// would go farther with each, and where light falls off along a surface, what arrives from the brighter side is more
// than what is lost to the darker one. And the lobes, as they are.
#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "common/count.glsl"
#include "common/alike.glsl"
#include "common/triangle_box.glsl"
#include "ground/cells.glsl"

const float SAME_PLANE = 0.5; // voxels between two surfaces that count as one

layout(local_size_x = 64) in;

#include "ground/frame.glsl"
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer Heads { uint heads[]; };
layout(scalar) readonly buffer ItemLights { ItemLight item_lights[]; };
layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };
layout(scalar) readonly buffer LitItems { uint lit_items[]; };
layout(scalar) writeonly buffer SeenLights { ItemLight seen_lights[]; };

#ifdef FEEDBACK
layout(scalar) writeonly buffer OwnLights { ItemLight own_lights[]; };
layout(scalar) readonly buffer ItemLobes { uvec2 item_lobes[]; };
layout(scalar) writeonly buffer SeenLobes { uvec2 seen_lobes[]; };
#endif

#include "ground/boxes.glsl"

// In voxels of the item's box.
struct Plane {
    vec3 normal; // unit
    float offset;
    uint facing;
    uint material;
};

Plane plane_of(uint item) {
    uint triangle = list_items[item].triangle;
    Box box = box_of(list_items[item].voxel);
    vec3 a = in_box(box, triangles[triangle].corners[0]);
    vec3 n =
        triangle_normal(a, in_box(box, triangles[triangle].corners[1]), in_box(box, triangles[triangle].corners[2]));
    COUNT(LIST_ITEMS, 1u);
    COUNT(CORNERS, 3u);
    COUNT(WORDS, 1u);
    vec3 unit = normalize(n);
    return Plane(unit, dot(unit, a), facing_cell(n), triangles[triangle].material);
}

// Whether the voxel lists one surface alone, or nothing. What a finer box has is not looked into.
bool undivided(Box box, ivec3 voxel) {
    uint head = heads[voxel_in(box, voxel)];
    COUNT(HEADS, 1u);
    COUNT(WORDS, 1u);
    return head == 0u ? !is_covered(box, voxel) : item_parts[item_parts[head - 1u].lit_by].alone != 0u;
}

// Whether that holds for every voxel on the way from one point to another, up to two voxels away along two axes: a
// slanting plane passes through others between.
bool undivided_between(Box box, vec3 from, vec3 to) {
    vec3 d = to - from;
    ivec3 voxel = ivec3(floor(from));
    ivec3 last = ivec3(floor(to));
    ivec3 way = ivec3(sign(d));
    // Where each axis crosses.
    vec3 next = mix((vec3(voxel) + max(sign(d), 0.0) - from) / d, vec3(1e30), equal(d, vec3(0.0)));
    bool free = true;
    for (uint i = 0u; i < 8u && free && voxel != last; i++) {
        free = undivided(box, voxel);
        bvec3 crossed = lessThanEqual(next, vec3(min(next.x, min(next.y, next.z)) + 1e-5)); // more than one at an edge
        voxel += ivec3(crossed) * way;
        next += mix(vec3(0.0), 1.0 / abs(d), crossed);
    }
    return free;
}

void main() {
    uint count = cell_counts[LIT_COUNTS].count;
    float few_passes = BOXES == 0u ? frame.light_share * frame.light_share : 1.0;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint item = lit_items[i];
        COUNT(WORDS, 17u);
        ItemLight sum = item_lights[item];
        float total = sum.area;
        sum.front *= total;
        sum.back *= total;
        Plane own = plane_of(item);
        int axis = int(dominant_axis(own.normal));
        Box box = box_of(list_items[item].voxel);
        vec3 center = vec3(cell_in(box, list_items[item].voxel)) + 0.5;
        vec3 here = center;
        here[axis] += (own.offset - dot(own.normal, here)) / own.normal[axis];
        bool shares = item_parts[item].alone != 0u && total > 0.0;
        for (int k = 0; k < (shares ? 25 : 0); k++) {
            ivec2 away = ivec2(k % 5, k / 5) - 2;
            bool near = max(abs(away.x), abs(away.y)) < 2;
            float share = few_passes * (abs(away.x) < 2 ? 1.0 : 0.5) * (abs(away.y) < 2 ? 1.0 : 0.5);
            vec3 there = center;
            there[(axis + 1) % 3] += float(away.x);
            there[(axis + 2) % 3] += float(away.y);
            there[axis] += (own.offset - dot(own.normal, there)) / own.normal[axis]; // where the plane goes on
            ivec3 voxel = ivec3(floor(there));
            bool inside = all(greaterThanEqual(voxel, ivec3(0))) && all(lessThan(voxel, ivec3(EDGE)));
            uint head = inside && k != 12 ? heads[voxel_in(box, voxel)] : 0u;
            uint neighbour = item_parts[max(head, 1u) - 1u].lit_by;
            COUNT(HEADS, 1u);
            COUNT(WORDS, 2u);
            if (head != 0u && item_parts[neighbour].alone != 0u) {
                Plane other = plane_of(neighbour);
                vec3 middle = vec3(voxel) + 0.5;
                float apart = abs(dot(own.normal, middle) - own.offset - dot(other.normal, middle) + other.offset);
                float height = floor(here[axis]);
                // Nothing lies between.
                bool level = height == floor(center[axis]) && height == float(voxel[axis]) && near;
                bool same = other.facing == own.facing && other.material == own.material && apart < SAME_PLANE;
                if (same && (level || undivided_between(box, here, there))) {
                    COUNT(WORDS, 8u);
                    ItemLight light = item_lights[neighbour];
                    sum.front += share * light.area * light.front;
                    sum.back += share * light.area * light.back;
                    total += share * light.area;
                }
            }
        }
        sum.front = total > 0.0 ? sum.front / total : item_lights[item].front;
        sum.back = total > 0.0 ? sum.back / total : item_lights[item].back;
        seen_lights[item] = sum;
#ifdef FEEDBACK
        COUNT(WORDS, 8u);
        own_lights[item] = item_lights[item];
        if (feature(FEATURE_SPECULAR)) {
            COUNT(WORDS, 8u);
            seen_lobes[2u * item] = item_lobes[2u * item];
            seen_lobes[2u * item + 1u] = item_lobes[2u * item + 1u];
        }
#endif
    }
}
