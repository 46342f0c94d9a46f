#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Shading, cells form, second half.
#include "gi/cones/constants.glsl"
#include "ground/faces/fill_cells.glsl"
