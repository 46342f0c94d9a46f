#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Lights the items of a grid's own lists; with LOOK_UP also by the result of the previous propagation.

#include "gi/lpv/constants.glsl"

const bool CLIPS_ITEMS = true;
const bool LIGHTS_FRONTS = false;

#include "ground/item_light.glsl"
#include "ground/heads.glsl"
#include "gi/lpv/push.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer CellCounts { ListCount cell_counts[]; };
layout(scalar) writeonly buffer ItemLights { ItemLight item_lights[]; };
layout(scalar) readonly buffer GridItems { ListItem grid_items[]; };

void main() {
    uint count = cell_counts[LIT_COUNTS].count;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        ListItem entry = grid_items[i];
        Triangle t = triangles[entry.triangle];
        mat3 corners = mat3(in_cells(t.corners[0]), in_cells(t.corners[1]), in_cells(t.corners[2]));
        item_lights[i] = light_item(i, entry.triangle, corners, cell_at(entry.voxel, LPV_EDGE));
    }
}
