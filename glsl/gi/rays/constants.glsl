// Constants of the method `rays`; src/gi/rays/mod.rs is their twin.

#include "ground/constants.glsl"

layout(constant_id) const uint DIFFUSE_RAYS = 8u; // per place
layout(constant_id) const uint LOBE_RAYS = 8u; // of a rough lobe, at most
layout(constant_id) const uint BOUNCES = 64u; // all: more than any ray takes
