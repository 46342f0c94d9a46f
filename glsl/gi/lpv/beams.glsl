// Light that travels through a cell as one beam: its flux, and the mean direction of travel. Two bands cannot represent
// light with one direction: sent on as cosine lobes, 95 % of a wall's light ends on that wall in a room 24 cells wide.
// The light of a cell has Henyey and Greenstein's distribution, (1 − g²) / (1 + g² − 2 g cos θ)^1.5, with mean cosine
// g, so that the length of the mean direction determines the width of the beam (a moment closure, as in radiative
// transfer). Light that a cell sends to the five faces of each neighbour keeps the directions to these faces. CPU twin:
// tests/twins/propagation.rs.

#include "ground/frame.glsl"
#include "gi/lpv/constants.glsl"
#include "gi/lpv/field.glsl"

struct Beam {
    vec4 flux; // rgb: stored radiance × area of a cell's face; a: the same for a sky of radiance 1
    vec3 moment; // weight of the flux × mean direction of travel
};

// One direction serves all channels: that of their sum, in which the sky has its own brightness, or almost none if
// there is other light.
float beam_weight(vec4 flux) {
    vec3 sky = frame.sky * frame.scale;
    return flux.r + flux.g + flux.b + flux.a * (sky.r + sky.g + sky.b + 1e-7 * frame.scale);
}

// Mean cosine of the light that a diffuse surface sends, or an opening admits.
const float DIFFUSE_COSINE = 0.6666667;

float towards(float cosine_times_g, float one_and_g2) {
    float x = one_and_g2 - 2.0 * cosine_times_g;
    return 1.0 / (x * sqrt(x));
}

// Along a direction of travel, in a frame with x along it, in which g is the mean direction: share, and share ×
// direction; both still have to be divided by the whole.
vec4 share_along(vec3 g, float one_and_g2) {
    float ahead = OPPOSITE * towards(g.x, one_and_g2);
    float b0 = SIDE * towards(SIDE_ALONG * g.x + SIDE_ACROSS * g.y, one_and_g2);
    float b1 = SIDE * towards(SIDE_ALONG * g.x - SIDE_ACROSS * g.y, one_and_g2);
    float c0 = SIDE * towards(SIDE_ALONG * g.x + SIDE_ACROSS * g.z, one_and_g2);
    float c1 = SIDE * towards(SIDE_ALONG * g.x - SIDE_ACROSS * g.z, one_and_g2);
    float sides = (b0 + b1) + (c0 + c1);
    return vec4(ahead + sides, ahead + SIDE_ALONG * sides, SIDE_ACROSS * (b0 - b1), SIDE_ACROSS * (c0 - c1));
}

// The distribution of a beam over neighbours.
struct Aim {
    vec3 g; // mean direction
    float to[6]; // shares of the neighbours along +x +y +z −x −y −z, times the whole
    float whole;
};

Aim aim_of(Beam beam) {
    float weight = beam_weight(beam.flux);
    vec3 g = weight > 0.0 ? beam.moment / weight : vec3(0.0);
    g *= min(1.0, SHARPNESS / max(length(g), 1e-6));
    float one_and_g2 = 1.0 + dot(g, g);
    float px = share_along(g, one_and_g2).x;
    float py = share_along(g.yzx, one_and_g2).x;
    float pz = share_along(g.zxy, one_and_g2).x;
    float nx = share_along(vec3(-g.x, g.yz), one_and_g2).x;
    float ny = share_along(vec3(-g.y, g.zx), one_and_g2).x;
    float nz = share_along(vec3(-g.z, g.xy), one_and_g2).x;
    // Thirty directions represent the sphere and sum up to all of the light.
    return Aim(g, float[6](px, py, pz, nx, ny, nz), ((px + py) + (pz + nx)) + (ny + nz));
}

// A beam as stored in a cell, in two texels, from which neighbours compute the light that they receive: storing the
// light for each neighbour would cost more.
struct KeptBeam {
    vec4 flux;
    vec4 direction; // mean direction; 1 / whole
};

KeptBeam kept_beam(Beam beam, Aim aim) {
    return KeptBeam(beam.flux, vec4(aim.g, 1.0 / aim.whole));
}
