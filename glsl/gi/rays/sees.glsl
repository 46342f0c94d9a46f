// Whether two points of what one item is lit for see each other.

#include "common/count.glsl"
#include "ground/ray.glsl"

layout(scalar) readonly buffer ItemParts { ItemPart item_parts[]; };

// Whether nothing opaque that the list of `voxel` holds stands between two points. What `lit_by` is lit for does not
// count: it is the surface itself.
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
