// Reflectance of a surface under uniform light from all directions.

#include "common/color.glsl"

// Fresnel reflectance of a microfacet, for the cosine between its normal and the light.
vec3 schlick(vec3 f0, float f90, float cosine) {
    return f0 + (f90 - f0) * pow(1.0 - cosine, 5.0);
}

float schlick(float f0, float f90, float cosine) {
    return schlick(vec3(f0), f90, cosine).x;
}

// The share of uniform light from all directions that a GGX lobe with separable Smith masking reflects towards a viewer
// at cosine nv: a fit of two integrals over visible normals, of the masking of the outgoing direction times 1 and times
// (1 − v·h)⁵. The errors are at most 0.02 for nv above 0.2, and 0.07 below; their root mean square over the visible
// side of a sphere is 0.006 and 0.003. tests/device/functions_geometry.rs has the integrals.
vec3 specular_albedo(vec3 f0, float f90, float roughness, float nv) {
    float r = roughness;
    vec3 per_nv = vec3(-0.33044, 1.88275, -1.90769)
        + r
            * (vec3(-0.6963, -3.47678, 6.88077)
                + r * (vec3(2.12184, -1.97397, -6.38837) + r * vec3(-1.51606, 3.17115, 1.54295)));
    float masked = 1.0 + r * (per_nv.x + nv * (per_nv.y + nv * per_nv.z));
    float grazing = exp2(
        -r * (2.07512 + 7.11586 * r) - nv * (6.02323 + r * (1.18408 * r - 11.93479) + nv * (8.85525 + 2.72356 * r)));
    return clamp(f0 * (masked - grazing) + f90 * grazing, vec3(0.0), vec3(1.0));
}

// The mean of 1 − Fresnel at the half vector under uniform light, which does not depend on the roughness. The
// polynomial fits the mean of (1 − v·h)⁵ within 1e-5.
float diffuse_share(float f0, float f90, float nv) {
    float grazing = 0.0281649 + nv * (-0.0798633 + nv * (0.0864900 + nv * (-0.0437062 + nv * 0.0089972)));
    return 1.0 - (f0 + (f90 - f0) * grazing);
}
