// The grid that is filled. Triangles are recorded in voxels of the base grid.

layout(push_constant, scalar) uniform GridPush {
    vec3 offset; // in voxels of the grid
    float scale; // voxels of the grid per voxel of the base grid
    uint first; // index of its first voxel among the heads
    ivec3 hole; // the first cell of a finer box that lists the content instead
    int hole_edge; // cells of the grid along each edge of that box; 0: there is none
} grid;

vec3 in_grid(vec3 recorded) {
    return recorded * grid.scale + grid.offset;
}
