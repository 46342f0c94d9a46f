// Constants and uniform block of the method `cones`. Twins: constants.rs and layout.rs in src/gi/cones.

#include "ground/constants.glsl"
#include "ground/faces/fill_kinds.glsl"

layout(constant_id) const uint CONE_SET = 1u; // 0: 1, 1: 5, 2: 6a, 3: 6b, 4: 16, 5: cosine-distributed
layout(constant_id) const uint CONE_COUNT = 5u; // of the set
layout(constant_id) const uint FILL = 0u;
layout(constant_id) const uint WEIGHTS = 0u;
layout(constant_id) const uint BLEND = 0u; // 0: over, 1: sum
layout(constant_id) const uint ROUGHNESS_FIT = 0u;
layout(constant_id) const uint PRINTED = 0u; // bit k: row Dk of the ledger as printed
// Bit 0: the diffuse cones rotate from place to place. Bit 1: shadow cones start at different distances.
layout(constant_id) const uint JITTER = 0u;

const uint COSINE_SETS = 5u;

const uint WEIGHTS_D2 = 0u;
const uint WEIGHTS_NORM1 = 1u;
const uint WEIGHTS_ABS = 2u;
const uint WEIGHTS_EXTINCTION = 3u;

bool printed(uint row) {
    return (PRINTED & (1u << row)) != 0u;
}

// Lengths in voxels.
struct Cones {
    float diffuse_start_normal;
    float diffuse_start_along;
    float diffuse_offset;
    float specular_start_normal;
    float specular_start_along;
    float refraction_start_normal;
    float refraction_start_along;
    float shadow_start_normal;
    float shadow_start_along;
    float shadow_end;
    float shadow_step; // as a multiple of the diameter
    float shadow_aperture; // tangent of the half angle; negative: computed from the light's radius
    float step; // as a multiple of the diameter
    float aperture; // factor of the diffuse set's apertures
    float exit_margin; // diameters by which a sum continues beyond the border
};

layout(scalar) readonly buffer ConesBuffer { Cones cones; };
