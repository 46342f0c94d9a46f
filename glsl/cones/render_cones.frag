#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Pass 5 with cones: the image alone.
#define CONES
#include "cones/render.glsl"
