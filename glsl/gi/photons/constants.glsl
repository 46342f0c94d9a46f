// Constants of the method `photons`. Twin: src/gi/photons/constants.rs. Lengths are in voxels of the base grid.

#include "ground/constants.glsl"

layout(constant_id) const uint DIFFUSE_CONES = 16u; // per place
layout(constant_id) const uint GLOSSY_CONES = 4u; // of a rough lobe, at most
layout(constant_id) const uint PRINTED = 0u; // a bit per correction that is left out
layout(constant_id) const uint COMPOSITE = 1u;
layout(constant_id) const uint OPACITY_KIND = 1u;
layout(constant_id) const uint AO_MULTIPLIES = 0u;
layout(constant_id) const uint KEEPS_BACKS = 0u; // 1: dark backs block light that leaves their front
layout(constant_id) const uint TURNED = 0u; // 1: the set of cones rotates from place to place
layout(constant_id) const float LEAST_STEP = 1.0; // lower bound of a sphere's extent
layout(constant_id) const float MOST_RATIO = 0.5; // upper bound of a sphere's radius over its distance
layout(constant_id) const float START_NORMAL = 0.5; // start of cones along the normal
layout(constant_id) const float START_ALONG = 0.0; // start of cones along themselves
layout(constant_id) const float AO_RATE = 0.0; // per metre

const uint COMPOSITE_OVER = 0u;
const uint COMPOSITE_SUM = 1u;

const uint OPACITY_SAMPLES = 0u; // the share of samples, equal in all directions
const uint OPACITY_SIDED = 1u; // the area that faces the direction

const uint AO_NOTHING = 0u;
const uint AO_LIGHT = 1u;

// Bits of PRINTED, which src/settings/methods/photons.rs names.
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
