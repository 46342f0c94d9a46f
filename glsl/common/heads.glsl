// Where heads[] has what: the first item of every voxel's list (1-based; 0: none), then a flag for every brick of voxels that
// is not 0 if a list of them has an item.
#ifndef HEADS_GLSL
#define HEADS_GLSL

int head_index(ivec3 voxel) {
    return (voxel.z * int(EDGE) + voxel.y) * int(EDGE) + voxel.x;
}

int brick_index(ivec3 voxel) {
    const int bricks = int(EDGE / BRICK);
    ivec3 brick = voxel / int(BRICK);
    return int(EDGE * EDGE * EDGE) + (brick.z * bricks + brick.y) * bricks + brick.x;
}

#endif
