// Method `rays`: exact rays through the lists find what the voxels shade.

#include "ground/interleave.glsl"
#include "gi/rays/lobes.glsl"
#include "ground/lamp_light.glsl"

const bool FINDS_LAMPS = true; // rays for what is mirrored or seen through glass meet them on their way

vec4 look_up_diffuse(Surface s, uvec3 place) {
    mat3 basis = tangent_frame(s.normal);
    vec2 shift = INTERLEAVE > 1u ? interleaved_shift(place) : vec2(0.5, 0.0);
    // Neighbours share what they find: a ray stands for its part of all their directions.
    float aperture = cosine_aperture(DIFFUSE_RAYS) / float(INTERLEAVE);
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < DIFFUSE_RAYS; i++) {
        vec4 seen = trace_light(s.position, s.facet, basis * cosine_direction(i, DIFFUSE_RAYS, shift), aperture);
        float open = 1.0 - min(seen.a, 1.0);
        sum += (1.0 / float(DIFFUSE_RAYS)) * vec4(seen.rgb + open * frame.sky * frame.scale, open);
    }
    return sum;
}

// One ray along the normal, as wide as the lobe.
vec3 look_up_specular(Surface s) {
    vec4 seen = trace_light(s.position, s.facet, s.normal, ggx_aperture(s.roughness));
    return seen.rgb + (1.0 - min(seen.a, 1.0)) * frame.sky * frame.scale;
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    Outgoing found = look_in_lobes(s, v, 1.0 - lamps_in_lobe(s.roughness));
    sent.direct += found.direct;
    sent.indirect += found.indirect;
}
