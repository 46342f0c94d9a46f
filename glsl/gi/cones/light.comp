#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Shading, cells form, first half.
#include "gi/cones/items.glsl"
#include "ground/light_items.glsl"
