// The grid of a pass, and its place in voxels of the base grid.

layout(push_constant, scalar) uniform Push {
    vec3 offset; // cells
    float scale; // cells per voxel of the base grid
    uint cascade; // 0: the finest
} push;

vec3 in_cells(vec3 recorded) {
    return recorded * push.scale + push.offset;
}
