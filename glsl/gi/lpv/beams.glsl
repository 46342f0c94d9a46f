// Light that travels through a cell as one beam: its flux, and the mean direction of travel. Two bands cannot hold light that
// goes one way: sent on as cosine lobes, cell after cell, 19 of 20 parts of what a wall sends come back to it. A cell's light
// here has Henyey and Greenstein's distribution, (1 − g²) / (1 + g² − 2 g cos θ)^1.5, whose mean cosine is g, so that the length
// of the mean direction says how narrow the beam is (a moment closure, as in radiative transfer). What a cell sends onto the
// five faces of each neighbour takes the directions to these faces along. CPU twin: tests/twins/propagation.rs.

struct Beam {
    vec4 flux; // rgb: stored radiance × area of a cell's face; a: the same of a sky of radiance 1
    vec3 moment; // weight of the flux × mean direction of travel
};

// What of a cell's light goes to one neighbour: x: its share; yzw: share × mean direction.
struct Shares {
    vec4 to[6]; // along +x +y +z −x −y −z
};

// One direction serves all channels: that of their sum, the sky as bright as it is, or, where nothing else is, hardly at all.
float beam_weight(vec4 flux) {
    vec3 sky = frame.sky * frame.scale;
    return flux.r + flux.g + flux.b + flux.a * (sky.r + sky.g + sky.b + 1e-7 * frame.scale);
}

// Mean cosine of what a diffuse surface sends, or an opening lets in.
const float DIFFUSE_COSINE = 0.6666667;

float towards(float cosine_times_g, float one_and_g2) {
    float x = one_and_g2 - 2.0 * cosine_times_g;
    return 1.0 / (x * sqrt(x));
}

// Along a way with the mean direction's part `a` along it, `b` and `c` across: share, and share × direction, in that frame.
vec4 share_along(float a, float b, float c, float one_and_g2) {
    float ahead = OPPOSITE * towards(a, one_and_g2);
    float b0 = SIDE * towards(SIDE_ALONG * a + SIDE_ACROSS * b, one_and_g2);
    float b1 = SIDE * towards(SIDE_ALONG * a - SIDE_ACROSS * b, one_and_g2);
    float c0 = SIDE * towards(SIDE_ALONG * a + SIDE_ACROSS * c, one_and_g2);
    float c1 = SIDE * towards(SIDE_ALONG * a - SIDE_ACROSS * c, one_and_g2);
    float sides = (b0 + b1) + (c0 + c1);
    return vec4(ahead + sides, ahead + SIDE_ALONG * sides, SIDE_ACROSS * (b0 - b1), SIDE_ACROSS * (c0 - c1));
}

Shares shares_of(Beam beam) {
    float weight = beam_weight(beam.flux);
    vec3 g = weight > 0.0 ? beam.moment / weight : vec3(0.0);
    g *= min(1.0, SHARPNESS / max(length(g), 1e-6));
    float one_and_g2 = 1.0 + dot(g, g);
    vec4 px = share_along(g.x, g.y, g.z, one_and_g2);
    vec4 py = share_along(g.y, g.z, g.x, one_and_g2);
    vec4 pz = share_along(g.z, g.x, g.y, one_and_g2);
    vec4 nx = share_along(-g.x, g.y, g.z, one_and_g2);
    vec4 ny = share_along(-g.y, g.z, g.x, one_and_g2);
    vec4 nz = share_along(-g.z, g.x, g.y, one_and_g2);
    // Thirty directions stand for the sphere: together they are all of the light.
    float whole = 1.0 / (((px.x + py.x) + (pz.x + nx.x)) + (ny.x + nz.x));
    return Shares(vec4[6](px * whole, vec4(py.x, py.w, py.y, py.z) * whole, vec4(pz.x, pz.z, pz.w, pz.y) * whole,
        vec4(nx.x, -nx.y, nx.z, nx.w) * whole, vec4(ny.x, ny.w, -ny.y, ny.z) * whole, vec4(nz.x, nz.z, nz.w, -nz.y) * whole));
}
