// The lighting of list items by the method `cones`.

#include "gi/cones/constants.glsl"

const bool CLIPS_ITEMS = FILL == FILL_COVERAGE || FILL == FILL_SIDED;
const bool LIGHTS_FRONTS = FILL == FILL_UNIFORM || FILL == FILL_FRONT;
