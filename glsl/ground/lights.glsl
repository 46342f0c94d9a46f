// Punctual lights (KHR_lights_punctual); glTF's numbers are taken as radiometric ones.

#include "common/count.glsl"
#include "ground/layout.glsl"

bool is_far(Light light) {
    return light.kind >= LIGHT_DIRECTIONAL;
}

struct LightSample {
    vec3 direction; // unit, from the surface to the light
    float distance; // voxels
    vec3 irradiance; // on a surface that faces the light
};

LightSample sample_light(Light light, vec3 position, float voxel_m) {
    LightSample s;
    COUNT(LIGHTS, 1u);
    if (is_far(light)) {
        s.direction = -light.direction;
        s.distance = 1e30;
        s.irradiance = light.intensity;
        return s;
    }
    vec3 to = light.position - position;
    s.distance = max(length(to), 1e-6); // avoids 0/0 for a light in a surface
    s.direction = to / s.distance;
    float d_m = s.distance * voxel_m;
    s.irradiance = light.intensity / (d_m * d_m);
    if (light.range_m < 1e30) {
        float q = d_m / light.range_m;
        s.irradiance *= clamp(1.0 - q * q * q * q, 0.0, 1.0);
    }
    if (light.kind == LIGHT_SPOT) {
        float cone = clamp(dot(-s.direction, light.direction) * light.spot_scale + light.spot_offset, 0.0, 1.0);
        s.irradiance *= cone * cone;
    }
    return s;
}
