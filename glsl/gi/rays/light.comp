#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with LOOK_UP
//! with ASKS
// Lights the items of the lists. With LOOK_UP they gather the light of the previous bounce, and with ASKS they request
// that light instead.
#include "ground/constants.glsl"

#include "ground/brdf.glsl"
#include "gi/rays/item_lobes.glsl"

layout(scalar) writeonly buffer ItemLobes { uvec2 item_lobes[]; }; // per list item and side

#define METHOD_POINTS
#define METHOD_LOBES

void keep_no_lobe(uint place) {
    item_lobes[place] = uvec2(0u);
}

float keep_lobe(uint place, Surface s, vec3 irradiance, vec3 sent, vec3 mean) {
    s = without_film(s, MEAN_COSINE);
    // Variances of slopes add up: those of the surface and of the lights' half vectors.
    float alpha = s.roughness * s.roughness;
    float share = smoothstep(LEAST_ITEM_ALPHA, WHOLE_ITEM_ALPHA, alpha);
    alpha = min(sqrt(alpha * alpha + 0.5 * (1.0 - min(length(mean), 1.0))), 1.0);
    ItemLobe lobe = ItemLobe(share * irradiance * s.f0, s.f90 / max(brightest(s.f0), 1e-4), normalize(mean), alpha);
    if (feature(FEATURE_LAYERS)) {
        // Layers over the surface are assumed to reflect in the same lobe.
        vec3 bare = irradiance / PI * specular_albedo(s.f0, s.f90, s.roughness, MEAN_COSINE);
        lobe.light *= brightest(sent) / max(brightest(bare), 1e-20);
    }
    lobe.light = min(lobe.light, vec3(LARGEST_STORED));
    COUNT(WORDS, 2u);
    item_lobes[place] = share > 0.0 ? pack_item_lobe(lobe) : uvec2(0u);
    return share;
}

const bool CLIPS_ITEMS = true;
const bool LIGHTS_FRONTS = false;

#include "ground/light_items.glsl"
