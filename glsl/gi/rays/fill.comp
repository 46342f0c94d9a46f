#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Fills the occupied voxels from what their items send.
#include "ground/constants.glsl"
#include "ground/faces/fill_kinds.glsl"

const uint FILL = FILL_SIDED;

#include "ground/faces/fill_cells.glsl"
