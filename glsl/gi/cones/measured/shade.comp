#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// The work of shade.frag in a dispatch, a thread per voxel of the whole grid: `examples/pages/layers.rs` holds layers
// against it.

layout(local_size_x_id, local_size_y_id, local_size_z_id) in;

#include "gi/cones/shade_voxel.glsl"
#include "ground/faces/store.glsl"

void main() {
    store_faces(gl_GlobalInvocationID, shade_voxel(gl_GlobalInvocationID));
}
