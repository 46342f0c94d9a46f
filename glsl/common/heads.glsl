// Where heads[] has what: the first item of every voxel's list (1-based; 0: none), then a flag for every brick of voxels that
// is not 0 if a list of them has an item.
#ifndef HEADS_GLSL
#define HEADS_GLSL

int head_index(ivec3 voxel) {
    return (voxel.z * int(EDGE) + voxel.y) * int(EDGE) + voxel.x;
}

// Back from an index; `edge`: of the grid's level.
uvec3 cell_at(uint index, uint edge) {
    return uvec3(index % edge, index / edge % edge, index / (edge * edge));
}

int brick_index(ivec3 voxel) {
    const int bricks = int(EDGE / BRICK);
    ivec3 brick = voxel / int(BRICK);
    return int(EDGE * EDGE * EDGE) + (brick.z * bricks + brick.y) * bricks + brick.x;
}

#endif
