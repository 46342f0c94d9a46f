// The lobe in which the surface of a lit item mirrors direct light. It is kept apart from what the item sends evenly: a
// rough floor or column that is lit at a grazing angle sends most of it onwards, and a ray that meets it sees that.

#include "common/item_lobe.glsl"

// A narrower lobe is sent evenly: the few rays that meet one would be spots. Between the two, a share of it.
const float LEAST_ITEM_ALPHA = 0.15;
const float WHOLE_ITEM_ALPHA = 0.3;
