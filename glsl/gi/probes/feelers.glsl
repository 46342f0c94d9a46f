// Relocation of probes by a few rays (Majercik et al., "Scaling Probe-Based Real-Time Dynamic Global Illumination for
// Production", 2021). The formulas are this project's own where the paper only describes a step. CPU twin:
// tests/twins/probes.rs.

#include "gi/probes/grid.glsl"

const uint FEELERS = 32u; // rays per probe
// A probe lies within a solid where a larger share of its rays meets back faces. The paper has a quarter, but beyond a
// corner of a room only an eighth of the rays meets back faces.
const float INSIDE_SHARE = 0.1;
const float LEAST_CLEARANCE = 0.2; // least distance of a probe from a surface where there is room, spacings
const float MOST_OFFSET = 0.45; // largest offset of a probe along each axis, spacings

// A summary of a probe's rays; distances are in voxels.
struct Felt {
    uint backs; // number of rays that met back faces
    float nearest_back; // distance of the nearest back face
    vec3 to_back; // unit, towards the nearest back face
    float nearest_front; // distance of the nearest front face
    vec3 to_front; // unit, towards the nearest front face
    float behind; // free distance in the opposite direction of `to_front`
};

// The displacement of the probe, voxels. A probe within a solid leaves it through the nearest back face. A probe too
// near to a surface moves away from it, but not past the middle of the free space.
vec3 probe_move(Felt felt, float spacing) {
    float clearance = LEAST_CLEARANCE * spacing;
    if (float(felt.backs) > INSIDE_SHARE * float(FEELERS)) {
        return felt.to_back * (felt.nearest_back + 0.5 * clearance);
    }
    if (felt.nearest_front < clearance) {
        float free = min(clearance, 0.5 * (felt.nearest_front + felt.behind));
        return -felt.to_front * max(free - felt.nearest_front, 0.0);
    }
    return vec3(0.0);
}
