#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Cells: the counts of voxels and items that the voxeliser listed. The counts of parents start at 0, and so does that
// of lit items if one item is lit per group.

#include "ground/layout.glsl"
#include "ground/constants.glsl"

layout(local_size_x = LIT_COUNTS + 1u) in; // a thread per level: 256³ has nine; the last one counts lit items

layout(scalar) readonly buffer GlobalsBuffer { Globals globals; };
layout(scalar) readonly buffer ListItems { ListItem list_items[]; };
layout(scalar) readonly buffer Cells { uint cells[]; };
layout(scalar) writeonly buffer CellCounts { ListCount cell_counts[]; };

void main() {
    uint level = gl_LocalInvocationID.x;
    if (EDGE >> level != 0u || level == LIT_COUNTS) {
        uint count = level == 0u                        ? min(globals.cell_count, uint(cells.length()))
            : level == LIT_COUNTS && LIT != LIT_GROUPED ? min(globals.item_count, uint(list_items.length()))
                                                        : 0u;
        cell_counts[level] = ListCount(min((count + 63u) / 64u, MOST_GROUPS), 1u, 1u, count);
    }
}
