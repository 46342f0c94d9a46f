#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Lights the items of the lists; with LOOK_UP they gather from the volume of the bounce before.
#include "ground/constants.glsl"

#include "ground/brdf.glsl"
#include "gi/rays/item_lobes.glsl"

#define METHOD_POINTS
#define METHOD_LOBES

void keep_no_lobe(uint place) {
    item_lobes[place] = uvec4(0u);
}

void keep_lobe_of(uint place, Surface s, vec3 irradiance, vec3 mean) {
    float lit = brightest(irradiance);
    vec3 toward = normalize(mean);
    vec3 f0 = min(irradiance * s.f0, vec3(LARGEST_STORED));
    item_lobes[place] = uvec4(packHalf2x16(f0.rg), packHalf2x16(vec2(f0.b, min(lit * s.f90, LARGEST_STORED))), packHalf2x16(toward.xy), packHalf2x16(vec2(toward.z, max(s.roughness * s.roughness, 0.05))));
}
const bool CLIPS_ITEMS = true;
const bool LIGHTS_FRONTS = false;

#include "ground/light_items.glsl"
