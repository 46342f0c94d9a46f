// Weights of the rays that a texel sums up, and of the probes about a point (Majercik et al., "Dynamic Diffuse Global
// Illumination with Ray-Traced Irradiance Fields", 2019). CPU twin: tests/twins/probes.rs.

// Of a ray whose direction has that cosine to a texel's, among distances: the cosine to the power of 50.
float distance_weight(float cosine) {
    float c = max(cosine, 0.0);
    float c2 = c * c;
    float c4 = c2 * c2;
    float c8 = c4 * c4;
    float c16 = c8 * c8;
    return c16 * c16 * c16 * c2;
}

// Of a probe by where it stands; the cosines are those of the way to it to the surface's normal and to its facet. As
// the papers have it what stands behind the surface counts a little, as long as it sees the place. Where a wall has two
// sides, probes on its other one then darken it: without `behind` they do not count.
float facing_weight(float cosine, float facet_cosine, bool behind) {
    float wrapped = 0.5 * cosine + 0.5;
    float before = facet_cosine > 0.0 ? wrapped * wrapped : 0.0;
    return behind ? wrapped * wrapped + 0.2 : before;
}

// The most of a point at that distance that the probe can see, by Chebyshev's inequality, cubed. `moments`: mean and
// mean square of the distances that the probe found in that direction.
float seen_weight(vec2 moments, float distance) {
    float beyond = max(distance - moments.x, 0.0);
    float variance = abs(moments.y - moments.x * moments.x);
    float share = beyond > 0.0 ? variance / (variance + beyond * beyond) : 1.0;
    return share * share * share;
}

const float FAINT = 0.2;

// A weight below a fifth falls with its cube: what hardly counts would leak in where nothing else counts.
float crushed(float weight) {
    return weight < FAINT ? weight * weight * weight / (FAINT * FAINT) : weight;
}
