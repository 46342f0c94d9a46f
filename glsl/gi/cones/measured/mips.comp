#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The work of mips.frag in a dispatch, a thread per cell of the whole level: `examples/pages/layers.rs` holds layers
// against it.

layout(local_size_x_id, local_size_y_id, local_size_z_id) in;

#include "gi/cones/talk_mips.glsl"
#include "ground/faces/store.glsl"

void main() {
    uvec3 cell = gl_GlobalInvocationID;
    if (all(lessThan(cell, uvec3(imageSize(faces_0))))) {
        store_faces(cell, mip_faces(2 * ivec3(cell)));
    }
}
