// The weight of a sample that either of two techniques may draw: the power heuristic with exponent 2 (Veach and Guibas,
// "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995).

// `own` and `other` are the densities per steradian of the sample's own technique and of the other one.
float power_share(float own, float other) {
    float ratio = own > 0.0 ? other / own : 1e15;
    return 1.0 / (1.0 + ratio * ratio);
}
