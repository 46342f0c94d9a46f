#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// New lists take over the light of the previous lists: a lit item gets that of the item for the same triangle in the
// same voxel, or in a voxel of a box that covered the place, and a twin that of its twin. Items without a predecessor
// start black. A thread per lit item.
#include "ground/constants.glsl"
#include "ground/layout.glsl"
#include "common/clip.glsl"
#include "common/count.glsl"
#include "ground/cells.glsl"

layout(local_size_x = 64) in;

#include "ground/frame.glsl"
layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };
layout(scalar) readonly buffer LitItems { uint lit_items[]; };
layout(scalar) writeonly buffer SeenLights { ItemLight seen_lights[]; };
layout(scalar) writeonly buffer SeenLobes { uvec2 seen_lobes[]; };
layout(scalar) readonly buffer LastHeads { uint last_heads[]; };
layout(scalar) readonly buffer LastItems { ListItem last_items[]; };
layout(scalar) readonly buffer LastParts { ItemPart last_parts[]; };
layout(scalar) readonly buffer LastLights { ItemLight last_lights[]; };

#include "ground/boxes.glsl"

// The voxel of the previous lists that listed a triangle in `voxel` of the new ones. If a box moved away there are
// several, and it is the one at the middle of the item's part.
uint last_voxel(uint voxel, uint triangle) {
    Box box = box_of(voxel);
    vec3 center = vec3(cell_in(box, voxel)) + 0.5;
    Box last = last_box_at(from_box(box, center));
    if (last.scale > box.scale) {
        mat3 corners = in_box(
            box, mat3(triangles[triangle].corners[0], triangles[triangle].corners[1], triangles[triangle].corners[2]));
        float area;
        clip_to_voxel(corners[0], corners[1], corners[2], vec3(center), area, center);
    }
    return voxel_in(last, ivec3(floor(in_box(last, from_box(box, center)))));
}

void main() {
    uint count = cell_counts[LIT_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint item = lit_items[i];
        ListItem entry = list_items[item];
        bool is_twin = item_parts[item].twin == item + 1u;
        uint source = triangles[entry.triangle].source;
        ItemLight before = ItemLight(vec3(0.0), 0.0, vec3(0.0), 0.0);
        uint last = last_heads[BOXES == 0u ? entry.voxel : last_voxel(entry.voxel, entry.triangle)];
        COUNT(LIST_ITEMS, 1u);
        COUNT(HEADS, 1u);
        for (uint k = 0u; k < uint(last_items.length()) && last != 0u; k++) {
            COUNT(LIST_ITEMS, 1u);
            bool same = last_parts[last - 1u].source == source;
            if (same) {
                uint lit_by = last_parts[last - 1u].lit_by;
                uint twin = last_parts[lit_by].twin;
                before = last_lights[is_twin && twin != 0u ? twin - 1u : lit_by];
            }
            last = same ? 0u : last_items[last - 1u].next;
        }
        seen_lights[item] = before;
        if (feature(FEATURE_SPECULAR)) {
            seen_lobes[2u * item] = uvec2(0u); // computed by this frame's first pass
            seen_lobes[2u * item + 1u] = uvec2(0u);
        }
    }
}
