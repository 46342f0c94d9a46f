// The sheen lobe of KHR_materials_sheen: distribution and visibility "Charlie" (Estevez and Kulla 2017). Twin:
// src/scene/sheen.rs.

#include "common/numbers.glsl"

float sheen_lambda(float alpha, float c) {
    float share = (1.0 - alpha) * (1.0 - alpha);
    vec3 fit = mix(vec3(21.5473, 3.82987, 0.19823), vec3(25.3245, 3.32435, 0.16801), share);
    vec2 line = mix(vec2(-1.97760, -4.32054), vec2(-1.27393, -4.85967), share);
    float x = c < 0.5 ? c : 1.0 - c;
    float at = fit.x / (1.0 + fit.y * pow(max(x, 1e-6), fit.z)) + line.x * x + line.y;
    float middle = fit.x / (1.0 + fit.y * pow(0.5, fit.z)) + line.x * 0.5 + line.y;
    return exp(c < 0.5 ? at : 2.0 * middle - at);
}

// D · V of a white sheen, 1/sr; cosines to the normal.
float sheen_lobe(float roughness, float nv, float nl, float nh) {
    float alpha = roughness * roughness;
    float d = (2.0 + 1.0 / alpha) * pow(max(1.0 - nh * nh, 1e-6), 0.5 / alpha) / (2.0 * PI);
    return d / ((1.0 + sheen_lambda(alpha, nv) + sheen_lambda(alpha, nl)) * 4.0 * nv * nl);
}
