// What a surface does with light from all around.

#include "common/color.glsl"

// Reflectance at a microfacet that light meets under this cosine.
vec3 schlick(vec3 f0, float f90, float cosine) {
    return f0 + (f90 - f0) * pow(1.0 - cosine, 5.0);
}

float schlick(float f0, float f90, float cosine) {
    return schlick(vec3(f0), f90, cosine).x;
}

// Share of light from all around that the specular lobe reflects towards v (Karis, "Physically Based Shading on Mobile",
// 2014: a fit to the split-sum integral, within 0.03 of it).
vec3 specular_albedo(vec3 f0, float f90, float roughness, float nv) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a004 = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 ab = vec2(-1.04, 1.04) * a004 + r.zw;
    return clamp(f0 * ab.x + f90 * ab.y, vec3(0.0), vec3(1.0));
}

// Mean of 1 − Fresnel at the half vector, over light from all around: whatever the roughness. The polynomial is fitted to the
// mean of (1 − v·h)⁵, within 1e-5 of it.
float diffuse_share(float f0, float f90, float nv) {
    float grazing = 0.0281649 + nv * (-0.0798633 + nv * (0.0864900 + nv * (-0.0437062 + nv * 0.0089972)));
    return 1.0 - (f0 + (f90 - f0) * grazing);
}
