// The number and spread of rays in a specular lobe, and the share of lamp light that they find; points on lamps find
// the rest. Both are weighted by the power heuristic with exponent 2 (Veach and Guibas, "Optimally Combining Sampling
// Techniques for Monte Carlo Rendering", 1995).

#include "common/power_heuristic.glsl"
#include "ground/brdf.glsl"
#include "ground/lamps.glsl"
#include "gi/rays/constants.glsl"

// The number of rays for a lobe that reflects the share `weight`: a weak one gets fewer.
uint lobe_ray_count(float alpha, float weight) {
    return alpha < MIN_ALPHA ? 1u : clamp(uint(ceil(weight * float(LOBE_RAYS))), 1u, LOBE_RAYS);
}

// The roughness from which light is gathered for a metal, and that from which all of its lobe's light is gathered.
const float WIDE_LOBE = 0.5;
const float WHOLE_LOBE = 0.8;

// Whether light is gathered for a metal: its lobe is so wide that directions over the hemisphere find its light well.
bool gathers_lobe(Surface s) {
    return feature(FEATURE_SPECULAR) && s.roughness > WIDE_LOBE && s.transmission == 0.0 && !is_brushed(s) && !s.unlit
        && any(greaterThan(s.f0, vec3(0.0)));
}

// The share of a lobe's light that gathered light represents. The few rays of a weak lobe would sometimes meet a bright
// spot. Gathered light has more directions, and is used down to a roughness of about 0.2, below which edges would be
// lost. It is also used for wide lobes, except those of a coat over a surface that gathers nothing (diffuse share 0).
float gathered_share(Surface s, Lobes lobes) {
    float weak = 1.0 - smoothstep(0.15, 0.3, brightest(lobes.specular));
    float of_weak = any(greaterThan(s.diffuse, vec3(0.0))) ? weak * smoothstep(0.2, 0.4, s.roughness) : 0.0;
    bool wide = gathers_lobe(s) && lobes.diffuse > 0.0;
    return max(of_weak, wide ? smoothstep(WIDE_LOBE, WHOLE_LOBE, s.roughness) : 0.0);
}

// Rays for the specular reflection, seen from outside.
uint mirrored_rays(Surface s, Lobes lobes) {
    float by_rays = 1.0 - gathered_share(s, lobes);
    bool mirrors = feature(FEATURE_SPECULAR) && by_rays > 0.0 && any(greaterThan(lobes.specular, vec3(0.0)));
    return mirrors ? lobe_ray_count(s.roughness * s.roughness, by_rays * brightest(lobes.specular)) : 0u;
}

// The α of a brushed surface along its grain and across it.
vec2 brushed_alphas(Surface s) {
    return vec2(s.finish.along, max(s.finish.across, MIN_ALPHA));
}

const float SHARP = 1e15; // rays per steradian in the direction of a mirror

// The rays per steradian about unit l, with the distribution of visible_normal; SHARP for a smooth surface.
float mirrored_rays_about(Surface s, Lobes lobes, vec3 v, vec3 l) {
    float alpha = s.roughness * s.roughness;
    vec3 h = normalize(l + v);
    float nl = max(dot(s.normal, l), 1e-6);
    float nv = max(abs(dot(s.normal, v)), 1e-4);
    float nh = clamp(dot(s.normal, h), 0.0, 1.0);
    float spread = ggx_lobe(alpha, nh, nl, nv) * (nl / lobe_masking(alpha, nl));
    if (is_brushed(s)) {
        vec3 local = vec3(dot(l, s.finish.grain), dot(l, cross(s.normal, s.finish.grain)), nl);
        spread = brushed_lobe(s, v, l, h, nv, nl, nh) * (nl / max(lobe_masking(brushed_alphas(s), local), 1e-6));
    }
    return alpha < MIN_ALPHA ? SHARP : float(mirrored_rays(s, lobes)) * spread;
}

// The number of points on lamps per unit of what they represent: of the irradiance if points are chosen for the place,
// otherwise of the total shine.
float lamp_points_over_light(Surface s) {
    float light = frame.lamp_tree != 0u ? lamps_irradiance(s.position, s.facet) : frame.lamp_shine;
    return float(LAMP_POINTS) / max(light, 1e-20);
}

// The number of points for a pixel relative to one place: rough surfaces share them with neighbours.
float points_shared(Surface s) {
    return frame.lamp_tree != 0u && scatters(s) ? 2.0 : 1.0;
}

// Points on lamps per steradian about a point on a lamp with that shine and facet normal, seen from a surface with
// normal `facet`; `way` is the vector to it. `over_light` is points over all light.
float lamp_points_about(float shine, vec3 normal, vec3 way, vec3 facet, float over_light) {
    float way2 = dot(way, way);
    float towards = max(abs(dot(way, normal)), 1e-6);
    float to_place = max(dot(way, facet), 0.0) * inversesqrt(max(way2, 1e-20));
    return over_light * shine * (frame.lamp_tree != 0u ? to_place : way2 * sqrt(way2) / towards);
}

// The share of a lamp's light in the lobe that a point on the lamp finds.
float point_share(Surface s, Lobes lobes, vec3 view, vec3 position, LampPoint to, float over_light) {
    vec3 way = to.point - position;
    float rays = mirrored_rays_about(s, lobes, view, normalize(way));
    float points = lamp_points_about(to.shine, to.normal, way, s.facet, points_shared(s) * over_light);
    return rays > 0.0 ? to.here * power_share(points, rays) : 1.0;
}

#define METHOD_LAMP_SHARES
// For the specular lobe and for the coat's lobe.
vec2 method_lamp_shares(Surface s, Lobes lobes, vec3 view, LampPoint to, float over_light) {
    vec2 shares = vec2(point_share(s, lobes, view, s.position, to, over_light), 1.0);
    if (feature(FEATURE_CLEARCOAT)) {
        shares.y = point_share(coat_of(s), coat_lobes(lobes), view, s.position, to, over_light);
    }
    return shares;
}
