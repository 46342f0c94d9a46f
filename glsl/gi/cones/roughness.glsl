// The talk's three maps from roughness to the tangent of a specular cone's half angle (D25: they disagree, so all are
// kept), and one derived from GGX. CPU twin: tests/twins/directions.rs.

#include "common/lobe.glsl"
#include "gi/cones/constants.glsl"

float roughness_to_aperture(float roughness) {
    float r = clamp(roughness, 0.0, 1.0);
    if (ROUGHNESS_FIT == 0u) {
        return tan(0.0003474660443456835 + r * (1.3331290497744692 - r * 0.5040552688878546));
    }
    if (ROUGHNESS_FIT == 1u) {
        float power = clamp(2.0 / max(1e-4, r * r) - 2.0, 4.0, 16384.0);
        return tan(acos(pow(0.244, 1.0 / (power + 1.0))));
    }
    if (ROUGHNESS_FIT == 3u) {
        return ggx_aperture(r);
    }
    return clamp(tan(PI * 0.375 * r), 0.00174533102, 3.14159265359);
}
