#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The parents of occupied voxels.
#include "ground/constants.glsl"
#include "ground/faces/mips.glsl"

vec4[7] mip_faces(ivec3 corner) {
    return average_children(corner);
}

#include "ground/faces/mips_cells.glsl"
