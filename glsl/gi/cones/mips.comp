#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Mips, cells form.
#include "gi/cones/talk_mips.glsl"
#include "ground/faces/mips_cells.glsl"
