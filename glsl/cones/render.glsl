// Pass 5, render: shades each pixel with direct light at every covered sample and, with CONES, cones into the second
// bounce's volume, once per pixel. Writes radiance, premultiplied by opacity.

#include "common/layout.glsl"
#include "common/constants.glsl"
#include "common/triangle_box.glsl"
#include "common/closest_point.glsl"
#include "cones/bindings.glsl"
#ifdef CONES
#include "cones/volumes.glsl"
#endif
#include "common/texture.glsl"
#include "common/surface.glsl"
#include "common/brdf.glsl"
#include "common/lights.glsl"
#include "common/jitter.glsl"
#ifdef CONES
#include "common/cone_set.glsl"
#include "common/roughness.glsl"
#include "common/cone.glsl"
#endif
#include "common/ray.glsl"
#include "common/lighting.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
} push;

#include "cones/image_samples.glsl"
#include "cones/mask.glsl"

layout(early_fragment_tests) in; // depth is there already

layout(location = 0) in vec3 in_weights;
layout(location = 1) centroid in vec3 in_centroid_weights;
layout(location = 2) flat in uint in_triangle;
layout(location = 3) flat in uint in_back;

layout(location = 0) out vec4 out_beauty;
#ifdef AOVS
layout(location = 1) out vec4 out_direct;
layout(location = 2) out vec4 out_indirect;
layout(location = 3) out vec4 out_ao;
layout(location = 4) out vec4 out_normal;
layout(location = 5) out vec4 out_depth;
layout(location = 6) out vec4 out_albedo;
#endif

// Light that arrives without a bounce, averaged over the covered samples.
vec3 direct_light(Surface s, vec3 a, uint covered) {
    vec3 sum = vec3(0.0);
    uint count = uint(bitCount(covered));
    for (uint left = covered; left != 0u; left &= left - 1u) {
        uint i = uint(findLSB(left));
        vec3 position = sample_position(i, a, s.facet);
        vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - position);
        for (uint k = 0u; k < frame.light_count; k++) {
            LightSample to = sample_light(lights[k], position, frame.voxel_m);
            vec3 reflected = to.irradiance * brdf_cos(s, view, to.direction);
            if (any(greaterThan(reflected, vec3(0.0)))) {
                sum += reflected * shadow_towards(lights[k], to, position, s.facet, s.normal, BOUNCE != 0u);
            }
        }
    }
    return sum / float(max(count, 1u));
}

void main() {
    Triangle t = triangles[in_triangle];
    COUNT(TRIANGLES, 1u);
    Footprint footprint = pixel_footprint(t, in_weights);
    vec3 a = t.vertices[0].position;
    uint covered = covered_samples(t, footprint);
    Surface s = evaluate_surface(t, in_centroid_weights, footprint, in_back != 0u);
    vec3 direct = s.emitted + (s.unlit ? vec3(0.0) : direct_light(s, a, covered));
    vec3 indirect = vec3(0.0);
    float open = 1.0;
#ifdef CONES
    if (!s.unlit) {
        vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
        vec3 specular = specular_albedo(s.f0, s.f90, s.roughness, max(dot(s.normal, view), 0.0));
        float rest = 1.0 - max(specular.r, max(specular.g, specular.b));
#ifndef AOVS
        if (any(greaterThan(s.diffuse, vec3(0.0))))
#endif
        {
            vec4 gathered = gather_diffuse(s.position, s.normal, uvec3(uvec2(gl_FragCoord.xy) + uvec2(0u, push.first_row), 0u));
            indirect += s.diffuse * rest * gathered.rgb;
            open = gathered.a;
        }
        if (feature(FEATURE_SPECULAR) && any(greaterThan(specular, vec3(0.0)))) {
            indirect += specular * gather_specular(s.position, s.normal, reflect(-view, s.normal), s.roughness);
        }
        if (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0) {
            indirect += s.transmitted * rest * gather_refraction(s, -view, in_back != 0u);
        }
        indirect /= frame.scale;
    }
#endif
    float opacity = s.opacity;
    out_beauty = vec4((direct + indirect) * opacity, opacity);
#ifdef AOVS
    out_direct = vec4(direct * opacity, opacity);
    out_indirect = vec4(indirect * opacity, opacity);
    out_ao = vec4(vec3(open) * opacity, opacity);
    out_normal = vec4(s.normal * opacity, opacity);
    float depth = dot(s.position - frame.eye, frame.forward) * frame.voxel_m;
    out_depth = vec4(vec3(depth) * opacity, opacity);
    out_albedo = vec4(s.albedo * opacity, opacity);
#endif
}
