// How the method `cones` lights list items.

#include "gi/cones/constants.glsl"

const bool CLIPS_ITEMS = FILL >= FILL_COVERAGE; // and sided
const bool LIGHTS_FRONTS = FILL == FILL_UNIFORM;
