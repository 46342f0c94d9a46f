// Constants of the method `paths`; src/gi/paths/mod.rs is their twin.

#include "ground/constants.glsl"

layout(constant_id) const uint PATHS = 1u; // per fragment and pass
layout(constant_id) const uint BOUNCES = 1u; // indirect bounces; ALL_BOUNCES: no limit

const uint ALL_BOUNCES = 1u << 30; // Bounces::limit in src/settings/choices.rs
