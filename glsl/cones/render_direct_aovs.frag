#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Direct light alone: the image and its layers.
#define AOVS
#include "cones/render.glsl"
