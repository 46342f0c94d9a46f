// Method `photons`: cones in directions sampled from the surface's BRDF, each as wide as its share of it.

#include "common/directions.glsl"
#include "common/jitter.glsl"
#include "common/lobe.glsl"
#include "common/refraction.glsl"
#include "ground/interleave.glsl"
#include "ground/brdf.glsl"
#include "ground/sky.glsl"
#include "gi/photons/cone.glsl"

const bool FINDS_LAMPS = false;
const float LEAST_COSINE = 0.1; // lower bound of the cosine between a cone and the surface that it leaves

// Light along d, with the sky behind. `normal` is that of the side where the cone starts. `bright` is as for sky_about.
vec4 cone_from(Surface s, vec3 normal, vec3 d, float ratio, float bright) {
    // Filtering extends to twice the radius of a sphere. With R ≤ ½ cos θ it does not reach the plane that the cone
    // leaves.
    float bound = MOST_RATIO * max(dot(d, normal), LEAST_COSINE);
    ConeLight seen = trace_cone(s.position + START_NORMAL * normal, d, printed(ROW_STEPS) ? ratio : min(ratio, bound));
    vec3 light = seen.light + seen.open * sky_about(d, ratio, bright);
    return vec4(AO_MULTIPLIES == AO_LIGHT ? light * seen.near : light, seen.near);
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    mat3 basis = tangent_frame(s.normal);
    vec2 shift =
        INTERLEAVE > 1u ? interleaved_shift(place) : vec2(0.5, TURNED != 0u ? jitter_hash(uvec4(place, 0u)) : 0.0);
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < DIFFUSE_CONES; i++) {
        // The density is cos/π. Pixels that share light have different parts of the directions of their square.
        vec3 local = cosine_direction(i, DIFFUSE_CONES, shift);
        float solid_angle = PI / (float(DIFFUSE_CONES * INTERLEAVE * INTERLEAVE) * local.z);
        sum += cone_from(s, s.facet, above_facet(basis * local, s.facet), cone_ratio(solid_angle), 0.0);
    }
    return sum / float(DIFFUSE_CONES);
}

// One cone along the normal, as wide as the lobe.
vec3 look_up_specular(Surface s) {
    return cone_from(s, s.facet, s.normal, ggx_aperture(s.roughness), 0.0).rgb;
}

// One cone for each of GGX's visible normals. A smooth lobe is one cone.
vec3 mirrored_light(Surface s, Viewed viewed) {
    float alpha = s.roughness * s.roughness;
    bool one = GLOSSY_CONES == 1u || alpha < MIN_ALPHA;
    uint count = one ? 1u : GLOSSY_CONES;
    vec3 normal = normalize(s.normal + viewed.view * max(1e-3 - dot(s.normal, viewed.view), 0.0));
    mat3 basis = tangent_frame(normal);
    vec3 v = viewed.view * basis;
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < count; i++) {
        vec2 u = vec2(fract(0.381966011 * float(i)), (float(i) + 0.5) / float(count));
        vec3 h = one ? vec3(0.0, 0.0, 1.0) : visible_normal(alpha, v, u);
        float cosine = clamp(dot(v, h), 0.0, 1.0);
        vec3 l = 2.0 * cosine * h - v;
        vec3 d = basis * l;
        if (l.z > 0.0 && dot(d, s.facet) > 0.0) {
            // The density of l is that of h over 4 v·h: G1(v) D(h) / (4 v.z).
            float a2 = alpha * alpha;
            float spread = h.z * h.z * (a2 - 1.0) + 1.0;
            float density = lobe_masking(alpha, v.z) * a2 / (PI * spread * spread) / max(4.0 * v.z, 1e-6);
            float ratio = one ? ggx_aperture(s.roughness) : cone_ratio(1.0 / max(float(count) * density, 1e-6));
            vec3 share = one ? viewed.lobes.specular : schlick(s.f0, s.f90, cosine) * lobe_masking(alpha, l.z);
            sum += share * cone_from(s, s.facet, d, ratio, 1.0 - lamps_in_lobe(s.roughness)).rgb;
        }
    }
    return sum / float(count);
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    if (feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)))) {
        sent.indirect += mirrored_light(s, v);
    }
    if (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0) {
        vec3 d = refraction_direction(-v.view, s.normal, s.ior, v.back, s.thickness_m <= 0.0);
        // Total reflection stays on its side.
        float side = dot(d, s.normal) > 0.0 ? 1.0 : -1.0;
        sent.indirect +=
            s.transmitted * v.lobes.rest * cone_from(s, side * s.facet, d, ggx_aperture(s.roughness), 1.0).rgb;
    }
}
