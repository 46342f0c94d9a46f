// Constants of the method `photons`; src/gi/photons/constants.rs is their twin. Lengths in voxels of the base grid.

#include "ground/constants.glsl"

layout(constant_id) const uint DIFFUSE_CONES = 16u; // per place
layout(constant_id) const uint GLOSSY_CONES = 4u; // of a rough lobe, at most
layout(constant_id) const uint PRINTED = 0u; // a bit per correction that is left out
layout(constant_id) const uint COMPOSITE = 1u;
layout(constant_id) const uint OPACITY_KIND = 1u;
layout(constant_id) const uint AO_MULTIPLIES = 0u;
layout(constant_id) const uint KEEPS_BACKS = 0u; // 1: dark backs stand in the way of what leaves their front
layout(constant_id) const uint TURNED = 0u; // 1: the set of cones turns from place to place
layout(constant_id) const float LEAST_STEP = 1.0; // extent of a sphere, at least
layout(constant_id) const float MOST_RATIO = 0.5; // radius of a sphere over its distance, at most
layout(constant_id) const float START_NORMAL = 0.5; // where cones start, along the normal,
layout(constant_id) const float START_ALONG = 0.0; // and along themselves
layout(constant_id) const float AO_RATE = 0.0; // per metre

const uint COMPOSITE_OVER = 0u;
const uint COMPOSITE_SUM = 1u;

const uint OPACITY_SAMPLES = 0u; // the share of samples, the same from everywhere
const uint OPACITY_SIDED = 1u; // the area that faces a traveller

const uint AO_NOTHING = 0u;
const uint AO_LIGHT = 1u;

// Bits of PRINTED: src/settings/methods/photons.rs names them.
const uint ROW_BEER = 0u;
const uint ROW_STEPS = 1u;
const uint ROW_STILL = 2u;
const uint ROW_COLOR = 3u;
const uint ROW_AO = 4u;
const uint ROW_MIPS = 5u;
const uint ROW_DIRECTIONS = 6u;
const uint ROW_SEAMS = 7u;
const uint ROW_PREMULTIPLIED = 8u;

bool printed(uint row) {
    return (PRINTED & (1u << row)) != 0u;
}
