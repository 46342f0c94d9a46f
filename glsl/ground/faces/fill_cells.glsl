// Fills the occupied voxels, a thread each, with the light of their items from light_items.glsl.
//! given const uint FILL = 3u;

#include "common/triangle_box.glsl"
#include "common/color.glsl"
#include "common/count.glsl"
#include "ground/bindings.glsl"
#include "ground/cells.glsl"
#include "ground/faces/store.glsl"
#include "ground/faces/fill.glsl"

layout(scalar) readonly buffer ItemLights { ItemLight item_lights[]; };
layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };

ItemLight light_of(uint item) {
    if (LIT != LIT_GROUPED) {
        return item_lights[item];
    }
    ItemLight light = item_lights[item_parts[item].lit_by];
    light.area = item_parts[item].area;
    return light;
}

void main() {
    uint count = cell_counts[0].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        uint item = heads[cells[i]];
        COUNT(HEADS, 1u);
        Filling filling = start_filling();
        for (uint k = 0u; k < globals.item_count && item != 0u; k++) {
            ListItem entry = list_items[item - 1u];
            COUNT(LIST_ITEMS, 1u);
            COUNT(CORNERS, 3u);
            COUNT(MATERIALS, 1u);
            COUNT(WORDS, LIT == LIT_GROUPED ? 10u : 8u); // ItemLight, ItemPart
            vec3 n = normalize(triangle_normal(triangles[entry.triangle].corners[0],
                triangles[entry.triangle].corners[1], triangles[entry.triangle].corners[2]));
            bool two_sided = (materials[triangles[entry.triangle].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
            fill_with(filling, light_of(item - 1u), n, two_sided);
            item = entry.next;
        }
        store_faces(cell_at(cells[i], EDGE), filled(filling));
    }
}
