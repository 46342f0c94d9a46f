// The specular lobe of a lit item's direct light, which is stored separately from its diffuse light: a rough floor or
// column that is lit at grazing angles reflects most of it forward, and rays that hit it see that.

#include "common/item_lobe.glsl"

// Light of a narrower lobe is sent uniformly, because the few rays that meet it would make spots. Between the two
// limits, a share of it is.
const float LEAST_ITEM_ALPHA = 0.15;
const float WHOLE_ITEM_ALPHA = 0.3;
