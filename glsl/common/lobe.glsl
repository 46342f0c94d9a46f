// The GGX lobe. CPU twin: tests/twins/directions.rs.

#include "common/numbers.glsl"

const float MIN_ALPHA = 1e-3; // roughness 0.03: the highlight of a point light in a mirror would be infinite

// A visible normal for v, both in the frame about the surface's normal, with density G1(v) D(h) (v·h) / v.z (Dupuy and
// Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023). `alpha` holds the values along the frame's x and
// y.
vec3 visible_normal(vec2 alpha, vec3 v, vec2 u) {
    vec3 stretched = normalize(vec3(alpha * v.xy, v.z));
    float phi = 2.0 * PI * u.x;
    float z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    float r = sqrt(max(1.0 - z * z, 0.0));
    vec3 h = vec3(r * cos(phi), r * sin(phi), z) + stretched;
    return normalize(vec3(alpha * h.xy, max(h.z, 1e-6)));
}

vec3 visible_normal(float alpha, vec3 v, vec2 u) {
    return visible_normal(vec2(alpha), v, u);
}

// Smith's masking of a direction with cosine c to the normal.
float lobe_masking(float alpha, float c) {
    float a2 = alpha * alpha;
    return 2.0 * c / max(c + sqrt(a2 + (1.0 - a2) * c * c), 1e-6);
}

// D · V: the density of normals with cosine nh, times the masking of two directions with the given cosines, divided by
// four times the product of the cosines. Masking is separable, as in glTF's appendix B.
float ggx_lobe(float alpha, float nh, float cosine, float other) {
    float a2 = alpha * alpha;
    float spread = nh * nh * (a2 - 1.0) + 1.0;
    vec2 c = vec2(cosine, other);
    vec2 sum = max(c + sqrt(a2 + (1.0 - a2) * c * c), vec2(1e-6));
    return a2 / (PI * spread * spread) / (sum.x * sum.y);
}

// The masking of a direction if α differs along the frame's x and y.
float lobe_masking(vec2 alpha, vec3 d) {
    return 2.0 * abs(d.z) / max(abs(d.z) + length(vec3(alpha * d.xy, d.z)), 1e-6);
}

// Tangent of the half angle of a cone with half the width of the lobe, from roughness in [0, 1]; derived in
// tests/twins/directions.rs.
float ggx_aperture(float roughness) {
    float alpha = roughness * roughness;
    return 1.70 * alpha / (1.0 + 0.76 * alpha * alpha);
}
