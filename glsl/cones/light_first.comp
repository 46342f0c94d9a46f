#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 2b: direct light and emission alone.
#include "cones/shade.glsl"
#include "cones/light.glsl"
