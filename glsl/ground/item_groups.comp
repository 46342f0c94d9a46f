#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Group: a voxel's triangles with one material and similar orientation form a group, and the item with the largest part
// in the voxel is lit for all. A thread per occupied voxel; the result does not depend on the order of lists. CPU twin:
// tests/twins/item_groups.rs.

#define WRITES_HEADS
#include "ground/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/clip.glsl"
#include "common/facing.glsl"
#include "common/count.glsl"
#include "ground/bindings.glsl"
#include "ground/cells.glsl"
#include "ground/boxes.glsl"
#include "ground/item_index.glsl"

layout(scalar) buffer ItemParts { ItemPart item_parts[]; };
layout(scalar) writeonly buffer LitItems { uint lit_items[]; };

// The items that are lit for each class of orientation.
uint chosen[FACING_CELLS]; // item, 1-based; 0: none
uint materials_of[FACING_CELLS];
uint sources_of[FACING_CELLS];
float areas_of[FACING_CELLS];

float area_in(vec3 a, vec3 b, vec3 c, uint voxel) {
    float area;
    vec3 middle;
    Box box = box_of(voxel);
    clip_to_voxel(in_box(box, a), in_box(box, b), in_box(box, c), vec3(cell_in(box, voxel)) + 0.5, area, middle);
    return area;
}

// With masks or blending, each triangle has its own opacity.
bool shares(uint material) {
    COUNT(MATERIALS, 1u);
    return (materials[material].flags & (MATERIAL_MASK | MATERIAL_BLEND)) == 0u;
}

void choose(uint first, uint voxel) {
    for (uint cell = 0u; cell < FACING_CELLS; cell++) {
        chosen[cell] = 0u;
    }
    for (uint item = first; item != 0u; item = list_items[item - 1u].next) {
        COUNT(LIST_ITEMS, 1u);
        COUNT(CORNERS, 3u);
        COUNT(WORDS, 2u); // its material and source
        uint triangle = list_items[item - 1u].triangle;
        enter_item(item, triangle, voxel);
        vec3 a = triangles[triangle].corners[0];
        vec3 b = triangles[triangle].corners[1];
        vec3 c = triangles[triangle].corners[2];
        float area = area_in(a, b, c, voxel);
        uint cell = facing_cell(triangle_normal(a, b, c));
        uint material = triangles[triangle].material;
        uint source = triangles[triangle].source;
        item_parts[item - 1u] = ItemPart(cell, area, source, 0u, 0u, 0u); // until the item that is lit for it is known
        bool same = chosen[cell] != 0u && material == materials_of[cell];
        bool better = chosen[cell] == 0u || material < materials_of[cell]
            || (same && (area > areas_of[cell] || (area == areas_of[cell] && source < sources_of[cell])));
        if (better && shares(material)) {
            chosen[cell] = item;
            materials_of[cell] = material;
            sources_of[cell] = source;
            areas_of[cell] = area;
        }
    }
}

void main() {
    uint count = cell_counts[0].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint first = heads[cells[i]];
        COUNT(HEADS, 1u);
        choose(first, cells[i]);
        uint lit = 0u; // items
        uint last_lit = 0u; // 1-based
        for (uint item = first; item != 0u; item = list_items[item - 1u].next) {
            COUNT(LIST_ITEMS, 1u);
            COUNT(WORDS, 2u); // its orientation and its material
            uint cell = item_parts[item - 1u].lit_by;
            uint material = triangles[list_items[item - 1u].triangle].material;
            bool alone = chosen[cell] == 0u || material != materials_of[cell] || !shares(material);
            uint lit_by = alone ? item : chosen[cell];
            item_parts[item - 1u].lit_by = lit_by - 1u;
            if (lit_by == item) {
                if (DEMAND == 0u) {
                    lit_items[take_place(LIT_COUNTS)] = item - 1u;
                }
                lit++;
                last_lit = item;
            }
        }
        if (lit == 1u) {
            item_parts[last_lit - 1u].alone = 1u;
        }
    }
}
