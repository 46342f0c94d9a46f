// Reflectance of a thin film in air (KHR_materials_iridescence, after Belcour and Barla 2017): Airy's sum with two
// orders of interference, weighted by Gaussians that approximate the eye's sensitivities over wavenumbers.

#include "common/albedo.glsl"
#include "common/numbers.glsl"

// The varying part of the sum for an optical path difference and a phase shift per channel.
vec3 film_sensitivity(float path_nm, vec3 turn) {
    const vec3 HEIGHT = vec3(5.4856e-13, 4.4201e-13, 5.2481e-13) / 1.0685e-7;
    const vec3 MIDDLE = vec3(1.6810e6, 1.7953e6, 2.2084e6);
    const vec3 VARIANCE = vec3(4.3278e9, 9.3046e9, 6.6121e9);
    float phase = 2.0 * PI * path_nm * 1e-9;
    vec3 xyz = HEIGHT * sqrt(2.0 * PI * VARIANCE) * cos(MIDDLE * phase + turn) * exp(-VARIANCE * phase * phase);
    const float SECOND_VARIANCE = 4.5282e9;
    xyz.x += 9.7470e-14 / 1.0685e-7 * sqrt(2.0 * PI * SECOND_VARIANCE) * cos(2.2399e6 * phase + turn.x)
        * exp(-SECOND_VARIANCE * phase * phase);
    const mat3 REC709_FROM_XYZ =
        mat3(3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.0415560, 1.0572252);
    return REC709_FROM_XYZ * xyz;
}

// The film over a base of reflectance f0 in air, for light at that cosine.
vec3 film_reflectance(float film_ior, float nm, vec3 f0, float cosine) {
    float ior = mix(1.0, film_ior, smoothstep(0.0, 0.03, nm));
    float cos2 = 1.0 - (1.0 - cosine * cosine) / (ior * ior);
    float cos_film = sqrt(max(cos2, 0.0));
    float r = (ior - 1.0) / (ior + 1.0);
    float r12 = schlick(r * r, 1.0, cosine);
    vec3 root = sqrt(clamp(f0, vec3(0.0), vec3(0.9999)));
    vec3 base = (1.0 + root) / (1.0 - root);
    vec3 inner = (base - ior) / (base + ior);
    vec3 r23 = schlick(inner * inner, 1.0, cos_film);
    vec3 turn = PI + mix(vec3(0.0), vec3(PI), lessThan(base, vec3(ior)));
    float t121 = 1.0 - r12;
    vec3 r123 = clamp(r12 * r23, vec3(1e-5), vec3(0.9999));
    vec3 repeated = t121 * t121 * r23 / (1.0 - r123);
    vec3 sum = r12 + repeated;
    vec3 share = repeated - t121;
    float path_nm = 2.0 * ior * nm * cos_film;
    for (int order = 1; order <= 2; order++) {
        share *= sqrt(r123);
        sum += 2.0 * share * film_sensitivity(float(order) * path_nm, float(order) * turn);
    }
    return cos2 <= 0.0 ? vec3(1.0) : clamp(sum, vec3(0.0), vec3(1.0));
}
