// The seven values of a voxel, from all lit items of its list.

#include "gi/cones/items.glsl"
#include "ground/item_light.glsl"
#include "ground/heads.glsl"
#include "ground/faces/fill.glsl"

vec4[7] shade_voxel(uvec3 voxel) {
    uint item = heads[head_index(ivec3(voxel))];
    COUNT(HEADS, 1u);
    Filling filling = start_filling();
    for (uint i = 0u; i < globals.item_count && item != 0u; i++) {
        ListItem entry = list_items[item - 1u];
        Triangle t = triangles[entry.triangle];
        vec3 n = normalize(triangle_normal(t.corners[0], t.corners[1], t.corners[2]));
        fill_with(filling, light_item(item - 1u, entry.triangle, corners_of(t), voxel), n,
            (materials[t.material].flags & MATERIAL_DOUBLE_SIDED) != 0u);
        item = entry.next;
    }
    return filled(filling);
}
