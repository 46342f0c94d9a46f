// Shading, cells form: a thread per occupied voxel. Needs: shade.glsl.

#include "cones/cells.glsl"
#include "cones/faces.glsl"

void main() {
    uint count = cell_counts[0].count;
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) {
        return;
    }
    do {
        uvec3 voxel = cell_at(cells[i], EDGE);
        store_faces(voxel, shade_voxel(voxel));
        i += gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    } while (i < count);
}
