// Weights of the rays of a texel, and of the probes about a point (Majercik et al., "Dynamic Diffuse Global
// Illumination with Ray-Traced Irradiance Fields", 2019). CPU twin: tests/twins/probes.rs.

// Weight of a ray in a texel of distances: the cosine between the ray and the texel's direction to the power of 50.
float distance_weight(float cosine) {
    float c = max(cosine, 0.0);
    float c2 = c * c;
    float c4 = c2 * c2;
    float c8 = c4 * c4;
    float c16 = c8 * c8;
    return c16 * c16 * c16 * c2;
}

// Weight of a probe by its direction from the surface point. The arguments are the cosines between that direction and
// the shading normal, and the facet normal. With `behind` a probe behind the surface has a small weight, as in the
// papers. Such probes darken a two-sided wall, so without `behind` their weight is 0.
float facing_weight(float cosine, float facet_cosine, bool behind) {
    float wrapped = 0.5 * cosine + 0.5;
    float before = facet_cosine > 0.0 ? wrapped * wrapped : 0.0;
    return behind ? wrapped * wrapped + 0.2 : before;
}

// Chebyshev's upper bound on the visibility of a point at that distance from the probe, cubed. `moments`: mean and mean
// square of the probe's distances in the direction of the point.
float seen_weight(vec2 moments, float distance) {
    float beyond = max(distance - moments.x, 0.0);
    float variance = abs(moments.y - moments.x * moments.x);
    float share = beyond > 0.0 ? variance / (variance + beyond * beyond) : 1.0;
    return share * share * share;
}

const float FAINT = 0.2;

// Reduces a weight below FAINT to its cube, scaled. Otherwise light would leak where all probes have small weights.
float crushed(float weight) {
    return weight < FAINT ? weight * weight * weight / (FAINT * FAINT) : weight;
}
