// The few rays by which a probe finds its place, and where it then stands (Majercik et al., "Scaling Probe-Based
// Real-Time Dynamic Global Illumination for Production", 2021, in own formulas where the paper has words). CPU twin:
// tests/twins/probes.rs.

#include "gi/probes/grid.glsl"

const uint FEELERS = 32u; // rays
// Share of them that meet backs from which on the probe stands in a solid. The paper has a quarter: beyond a corner of
// a room backs are an eighth.
const float INSIDE_SHARE = 0.1;
const float LEAST_CLEARANCE = 0.2; // spacings that a probe keeps off a surface, where there is room
const float MOST_OFFSET = 0.45; // spacings that a probe is moved along each axis

// What the rays of a probe met; distances in voxels.
struct Felt {
    uint backs;
    float nearest_back;
    vec3 to_back; // unit
    float nearest_front;
    vec3 to_front; // unit
    float behind; // free way opposite to the nearest front
};

// How far the probe moves: out of a solid through its nearest back, or off a surface that is too near, as long as
// nothing nearer is behind it.
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
