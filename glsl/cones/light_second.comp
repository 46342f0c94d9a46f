#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 4b: direct light, emission, and one gather from the first bounce.
#define CONES
#include "cones/shade.glsl"
#include "cones/light.glsl"
