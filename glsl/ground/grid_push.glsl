// Which grid is filled: triangles are recorded in voxels of the base grid.

layout(push_constant, scalar) uniform GridPush {
    vec3 offset; // voxels of the grid
    float scale; // its voxels per voxel of the base grid
} grid;

vec3 in_grid(vec3 recorded) {
    return recorded * grid.scale + grid.offset;
}
