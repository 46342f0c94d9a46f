#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Empties voxels of a volume of faces that the last frame filled and this one does not.

#include "ground/layout.glsl"
#include "ground/constants.glsl"
#include "ground/faces/store.glsl"

void empty_cell(uvec3 cell) {
    store_faces(cell, vec4[7](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)));
}

#include "ground/empty_cells.glsl"
