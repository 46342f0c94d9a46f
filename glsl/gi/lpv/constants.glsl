// Constants of the method `lpv`; src/gi/lpv/mod.rs is their twin.

#include "ground/constants.glsl"

layout(constant_id) const uint LPV_EDGE = 32u; // cells along the edge of each grid
layout(constant_id) const uint CASCADES = 1u;
layout(constant_id) const uint LOBE = 2u; // distribution of a cell's light over directions
layout(constant_id) const uint OCCLUSION = 2u;
layout(constant_id) const uint SUM = 1u; // where the light of all steps is summed
layout(constant_id) const uint INJECTION = 1u; // where a surface's light starts
layout(constant_id) const uint APPLY = 1u; // how irradiance is computed
layout(constant_id) const float SHARPNESS = 0.5; // mean cosine of the narrowest beam
layout(constant_id) const bool FIRST_STEP = false; // of propagation

const uint LOBE_COSINE = 0u; // 1 + 2 cos θ, the clamped cosine in two bands, which is cut off behind
const uint LOBE_COSINE_PI = 1u; // the cosine, with the coefficients of integral π that the source's author published
const uint LOBE_BEAM = 2u; // as narrow as the light of the cell
const uint OCCLUSION_NONE = 0u;
const uint OCCLUSION_SH = 1u;
const uint OCCLUSION_SHEETS = 2u;
const uint SUM_OWN = 0u; // every step starts from the cell's own light, and the last one is the sum
const uint SUM_APART = 1u;
const uint INJECTION_CELL = 0u;
const uint INJECTION_FRONT = 1u;
const uint APPLY_SH = 0u;
const uint APPLY_FLUX = 1u;

const uint CELLS_PER_GRID = LPV_EDGE * LPV_EDGE * LPV_EDGE;
