#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
// Lights the items of the lists: the photons. With LOOK_UP they gather from the volume of the bounce before.
#include "ground/constants.glsl"
#include "common/color.glsl"
#include "ground/brdf.glsl"
#include "gi/photons/lobes.glsl"

#define METHOD_LOBES

void keep_no_lobe(uint place) {
    item_lobes[place] = uvec4(0u);
}

float keep_lobe(uint place, Surface s, vec3 irradiance, vec3 sent, vec3 mean) {
    LobeLight lobe = lobe_light(sent, s.facet, mean, s.roughness);
    lobe.light = min(lobe.light, vec3(LARGEST_STORED));
    item_lobes[place] = pack_lobe(lobe);
    return 1.0;
}

const bool CLIPS_ITEMS = true;
const bool LIGHTS_FRONTS = false;

#include "ground/light_items.glsl"
