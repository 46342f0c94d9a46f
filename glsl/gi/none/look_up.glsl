// Method `none`: no light from other surfaces, and sky light without occlusion. The docs of `IndirectMethod` in
// src/gi/mod.rs describe the functions of a look-up.

#include "common/lobe.glsl"
#include "common/refraction.glsl"
#include "ground/brdf.glsl"
#include "ground/sky.glsl"

const bool FINDS_LAMPS = false;

vec4 look_up_diffuse(Surface s, uvec3 place) {
    return vec4(sky_over(s.normal), 1.0);
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    float aperture = ggx_aperture(s.roughness);
    if (feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)))) {
        sent.indirect += v.lobes.specular * sky_about(mirrored(s, v.view), aperture, 1.0 - lamps_in_lobe(s.roughness));
    }
    if (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0) {
        vec3 d = refraction_direction(-v.view, s.normal, s.ior, v.back, s.thickness_m <= 0.0);
        sent.indirect += s.transmitted * v.lobes.rest * sky_about(d, aperture, 1.0);
    }
}
