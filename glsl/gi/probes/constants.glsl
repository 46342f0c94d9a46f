// Constants of the method `probes`; src/gi/probes/constants.rs is their twin.

#include "ground/constants.glsl"

layout(constant_id) const uint PROBE_EDGE = 16u; // probes along each edge of a grid
layout(constant_id) const uint CASCADES = 1u; // grids, the finest first
layout(constant_id) const uint PROBE_RAYS = 256u; // per probe and pass
layout(constant_id) const uint LOBE_RAYS = 4u; // most rays per rough lobe
layout(constant_id) const float BIAS = 0.3; // self-shadow bias of look-ups, as in the papers
layout(constant_id) const bool COUNTS_BEHIND = false; // whether probes behind a surface have a small weight
layout(constant_id) const bool VISIBILITY = true; // whether a wall reduces the weight of the probes that it hides
layout(constant_id) const bool CLASSIFY = true; // whether probes that light nothing send no rays
layout(constant_id) const float HYSTERESIS = 0.0; // share of a texel that stays from the pass before
layout(constant_id) const uint BOUNCES = 64u; // all: more than any ray takes

const uint PROBES_PER_GRID = PROBE_EDGE * PROBE_EDGE * PROBE_EDGE;
