// Visibility between two points within the region of one lit item.

#include "common/count.glsl"
#include "ground/ray.glsl"

layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };

// Whether no opaque triangle in the list of `voxel` lies between two points. Triangles for which `lit_by` is lit do not
// count, because they are the surface itself.
bool sees(uint voxel, uint lit_by, vec3 from, vec3 to) {
    bool free = true;
    uint item = heads[voxel];
    COUNT(HEADS, 1u);
    for (uint k = 0u; k < globals.item_count && item != 0u; k++) {
        ListItem entry = list_items[item - 1u];
        COUNT(LIST_ITEMS, 1u);
        COUNT(WORDS, 1u);
        vec2 uv;
        float hit = hit_recorded(entry.triangle, from, to - from, uv);
        bool cuts = hit > 0.0 && hit < 1.0 && item_parts[item - 1u].lit_by != lit_by;
        if (feature(FEATURE_ALPHA)) {
            uint material = triangles[entry.triangle].material;
            cuts = cuts && is_opaque(materials[material].flags, materials[material].transmission);
        }
        free = free && !cuts;
        item = free ? entry.next : 0u;
    }
    return free;
}
