#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 5 with diffuse light from passes 5a and 5b: the image alone.
#define CONES
#define GATHERED
#include "cones/render.glsl"
