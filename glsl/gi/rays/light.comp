#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Lights the items of the lists; with LOOK_UP they gather from the volume of the bounce before.
#include "ground/constants.glsl"

#define METHOD_POINTS
const bool CLIPS_ITEMS = true;
const bool LIGHTS_FRONTS = false;

#include "ground/light_items.glsl"
