#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method
// Given: lights surfaces that a host drew, by their depth, normal, base colour and, unless all are Lambertian,
// roughness and metallic. The scene lights them, and they need not be part of it. Writes radiance; alpha is 1 for
// pixels with a surface.

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"
#include "ground/lamp_light.glsl"
#include "ground/image/view_way.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D given_depth; // metres along the view's axis; 0 or FAR without a surface
uniform sampler2D given_normal;
uniform sampler2D given_albedo;
uniform sampler2D given_material; // roughness, metallic, specular
layout(rgba32f) writeonly uniform image2D given_direct;
layout(rgba32f) writeonly uniform image2D given_indirect;

layout(push_constant) uniform Push {
    uint has_material;
} push; // otherwise surfaces are Lambertian

const float FAR = 1e30; // this and larger depths are background
const float DIELECTRIC_F0 = 0.04; // of glTF's index of refraction of 1.5

Surface given_surface(ivec2 at, float depth) {
    // All passes of a host over an image show the same samples.
    vec3 across = off_axis(vec2(at) + 0.5 + 0.5 * frame.ndc_shift * frame.image_size);
    float way = depth / frame.voxel_m;
    Surface s;
    s.position = frame.eye + frame.forward * way + across * (frame.orthographic != 0u ? 1.0 : way);
    s.normal = normalize(texelFetch(given_normal, at, 0).xyz);
    s.facet = s.normal;
    s.albedo = texelFetch(given_albedo, at, 0).rgb;
    bool glossy = push.has_material != 0u;
    vec3 material = glossy ? clamp(texelFetch(given_material, at, 0).xyz, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    s.diffuse_share = 1.0 - material.y;
    s.diffuse = s.albedo * s.diffuse_share;
    s.f0 = mix(vec3(DIELECTRIC_F0 * material.z), s.albedo, material.y);
    s.f90 = mix(material.z, 1.0, material.y);
    s.coat_f0 = DIELECTRIC_F0 * material.z;
    s.coat_f90 = material.z;
    s.roughness = material.x;
    s.opacity = 1.0;
    s.transmitted = vec3(0.0);
    s.transmission = 0.0;
    s.emitted = vec3(0.0);
    s.ior = 1.5;
    s.thickness_m = 0.0;
    s.unlit = false;
    s.finish = NO_FINISH;
    return s;
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, ivec2(frame.image_size)))) {
        return;
    }
    float depth = texelFetch(given_depth, at, 0).r;
    bool there = depth > 0.0 && depth < FAR && any(notEqual(texelFetch(given_normal, at, 0).xyz, vec3(0.0)));
    Surface s = given_surface(at, there ? depth : 1.0);
    vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
    Viewed viewed = Viewed(view, lobes_towards(s, view), false, 0.0);
    vec3 direct = vec3(0.0);
    vec3 gathered = vec3(0.0);
    vec3 gathered_lobe = vec3(0.0);
    // These are loops, which a CPU device leaves early, and which name each look-up once.
    for (uint k = 0u; k < (there ? frame.light_count : 0u); k++) {
        LightSample to = sample_light(lights[k], s.position, frame.voxel_m);
        vec3 reflected = to.irradiance * brdf_cos(s, view, to.direction, lights[k].kind == LIGHT_SKY);
        if (any(greaterThan(reflected, vec3(0.0)))) {
            direct += reflected * shadow_towards(lights[k], to, s, s.position, 0u, 1u);
        }
    }
    // Nothing is shared with neighbours, so each pixel uses all directions that they would have.
    const uint places = INTERLEAVE * INTERLEAVE;
    for (uint k = 0u; k < (there ? places : 0u); k++) {
        uvec3 place = places == 1u ? uvec3(at, 0u) : uvec3(k % INTERLEAVE, k / INTERLEAVE, 0u);
#ifdef METHOD_GATHERS_LOBES
        vec3 mirrored;
        gathered += look_up_for_view(s, view, place, false, mirrored).rgb / float(places);
        gathered_lobe += mirrored / float(places);
#else
        gathered += look_up_diffuse(s, place).rgb / float(places);
#endif
    }
    Outgoing sent = Outgoing(direct, s.diffuse * viewed.lobes.diffuse * gathered);
#ifdef METHOD_GATHERS_LOBES
    sent.indirect += gathered_share(s, viewed.lobes) * gathered_lobe;
#endif
    for (uint k = 0u; k < (there ? 1u : 0u); k++) {
        LampLight lamps = lamp_light(s, view);
        sent.direct += s.diffuse * viewed.lobes.diffuse * lamps.diffuse + lamps.specular;
        sent.direct += FINDS_LAMPS ? vec3(0.0) : lamps_along_rays(s, viewed);
        add_glossy(sent, s, viewed);
    }
    imageStore(given_direct, at, vec4(sent.direct, there ? 1.0 : 0.0));
    imageStore(given_indirect, at, vec4(sent.indirect / frame.scale, there ? 1.0 : 0.0));
}
