// Which grid is filled: triangles are recorded in voxels of the base grid.

layout(push_constant, scalar) uniform GridPush {
    vec3 offset; // voxels of the grid
    float scale; // its voxels per voxel of the base grid
    uint first; // place of its first voxel among the heads
    ivec3 hole; // the cell at which a finer box begins that lists what is in there,
    int hole_edge; // so many of its cells along each edge; 0: there is none
} grid;

vec3 in_grid(vec3 recorded) {
    return recorded * grid.scale + grid.offset;
}
