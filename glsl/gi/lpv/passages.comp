#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The shares of light that pass into each cell from its six neighbours. The light of a cell is in front of the surfaces
// in it: it is blocked on leaving through the front of a surface, and on entering a cell through a surface from either
// side.

#include "gi/lpv/constants.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"
#include "gi/lpv/push.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(scalar) readonly buffer BlockersBuffer { uvec4 blockers[]; };
layout(scalar) writeonly buffer Passages { uvec3 passages[]; };

Blockers blockers_in(ivec3 cell) {
    if (!in_volume(cell)) {
        return Blockers(vec3(0.0), vec3(0.0), 0.0);
    }
    return unpack_blockers(blockers[push.cascade * CELLS_PER_GRID + cell_index(cell)]);
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    vec3 entry = 1.0 - across(blockers_in(cell));
    Passage passage;
    for (int axis = 0; axis < 3; axis++) {
        ivec3 step = ivec3(axis == 0, axis == 1, axis == 2);
        passage.up[axis] = entry[axis] * (1.0 - blockers_in(cell - step).down[axis]);
        passage.down[axis] = entry[axis] * (1.0 - blockers_in(cell + step).up[axis]);
    }
    passages[push.cascade * CELLS_PER_GRID + cell_index(cell)] = pack_passage(passage);
}
