// heads[] holds the first item of every voxel's list (1-based; 0: none).
#include "ground/constants.glsl"

int head_index(ivec3 voxel) {
    return (voxel.z * int(EDGE) + voxel.y) * int(EDGE) + voxel.x;
}

// The inverse; `edge` is that of the grid's level.
uvec3 cell_at(uint index, uint edge) {
    return uvec3(index % edge, index / edge % edge, index / (edge * edge));
}
