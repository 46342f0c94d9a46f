// Method `probes`: the probes about a point give diffuse light; exact rays give reflection and transmission.

#include "common/directions.glsl"
#include "common/lobe.glsl"
#include "common/refraction.glsl"
#include "ground/brdf.glsl"
#include "ground/sky.glsl"
#include "ground/ray.glsl"
#include "ground/place_random.glsl"
#include "gi/probes/hit_light.glsl"

const bool FINDS_LAMPS = false;

// Unit direction towards the viewer. The viewer of a list item looks along its facet normal.
vec3 looked_from(Surface s) {
#ifdef LIGHTS_ITEMS
    return s.facet;
#else
    return frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
#endif
}

vec4 look_up_diffuse(Surface s, uvec3 place) {
    vec4 found = probes_light(lit_point(s.position, s.normal, s.facet, looked_from(s)), BOUNCES);
    return vec4(found.rgb, min(found.a, 1.0));
}

vec3 look_up_specular(Surface s) {
    return look_up_diffuse(s, uvec3(0u)).rgb;
}

// Most surfaces that one ray meets: it continues through glass and from mirrors.
const uint MOST_INTERFACES = 16u;
// Above the roughness WIDE_LOBE probes give a part of the reflection, and above WHOLE_LOBE all of it. A probe's texel
// holds light of a whole hemisphere, which resembles a rough lobe.
const float WIDE_LOBE = 0.4;
const float WHOLE_LOBE = 0.7;

// Share of a metal's reflection that a mirror ray shows, 0 to 1.
float mirror_share(Surface s) {
    float metal = 1.0 - s.diffuse_share - s.transmission;
    bool mirrors = !s.unlit && s.opacity == 1.0 && s.transmission == 0.0;
    return mirrors ? metal * (1.0 - smoothstep(0.3, 0.4, s.roughness)) : 0.0;
}

// Stored radiance along a ray that leaves a surface with facet normal `facet` along unit d, including the sky's.
// `aperture` and `bright` are those of sky_about. `mirrors` counts the reflections before this ray, each a bounce.
vec3 seen_along(vec3 position, vec3 facet, vec3 d, float aperture, float bright, uint mirrors) {
    vec3 origin = ray_start(position, facet, d);
    vec3 sum = vec3(0.0);
    vec3 through = vec3(1.0);
    float least = 0.0;
    bool going = true;
    for (uint i = 0u; i < (feature(FEATURE_PASSING | FEATURE_MIRRORS) ? MOST_INTERFACES : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        sum += met.any ? vec3(0.0) : through * sky_about(d, aperture, bright);
        Surface s = evaluate_surface(met.triangle, attributes_of(met.place), met.weights, POINT, met.back);
        float transmission = feature(FEATURE_TRANSMISSION) ? s.transmission : 0.0;
        bool glass = transmission > 0.0 && s.thickness_m > 0.0;
        bool lit = met.any && !met.dark && mirrors <= BOUNCES;
        float mirrored = feature(FEATURE_MIRRORS) && lit ? mirror_share(s) : 0.0;
        float stays = s.opacity * (1.0 - transmission) * (1.0 - mirrored);
        // This loop has at most one round: a CPU device skips a loop that no lane enters.
        for (uint once = 0u; once < (lit && stays > 0.0 ? 1u : 0u); once++) {
            vec3 sent = direct_at(s) + bounced_at(s, -d, BOUNCES - mirrors);
            sum += through * stays * min(sent, vec3(LARGEST_STORED));
        }
        vec3 at = origin + d * met.distance;
        if (glass) {
            vec3 n = normal_against(s.normal, d);
            vec3 way = refraction_direction(d, n, max(s.ior, 1.0), met.back, false);
            bool leaves = dot(way, s.facet) < 0.0;
            through *= leaves ? s.albedo * transmission : vec3(1.0);
            through *=
                met.back ? attenuation(materials[met.triangle.material], met.distance * frame.voxel_m) : vec3(1.0);
            d = way;
            origin = at + s.facet * (leaves ? -ray_start_at(at) : ray_start_at(at));
            least = 0.0;
        } else if (mirrored > 0.0) {
            through *= mirrored * lobes_towards(s, -d).specular;
            d = above_facet(reflect(d, normal_against(s.normal, d)), s.facet);
            origin = at + s.facet * ray_start_at(at);
            least = 0.0;
            mirrors++;
        } else {
            through *= mix(vec3(1.0), s.albedo * transmission, s.opacity);
            least = met.distance;
        }
        bool passes = feature(FEATURE_PASSING) && met.triangle.translucent != 0u;
        going = met.any && (passes || mirrored > 0.0) && mirrors <= BOUNCES && brightest(through) >= SPENT;
    }
    return sum;
}

void add_glossy(inout Outgoing sent, Surface s, Viewed v) {
    float alpha = s.roughness * s.roughness;
    bool reflects = feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)));
    bool transmits = feature(FEATURE_TRANSMISSION) && s.transmission > 0.0;
    float wide = reflects ? smoothstep(WIDE_LOBE, WHOLE_LOBE, s.roughness) : 0.0;
    vec3 d = mirrored(s, v.view);
    if (wide > 0.0) {
        // The mean direction of a rough lobe lies between the mirror direction and the normal.
        vec3 middle = normalize(mix(d, s.normal, alpha));
        sent.indirect +=
            wide * v.lobes.specular * probes_light(lit_point(s.position, middle, s.facet, v.view), BOUNCES).rgb;
    }
    vec2 shift = place_random(s.position);
    mat3 basis = tangent_frame(s.normal);
    float aperture = ggx_aperture(s.roughness);
    uint mirrored_rays = reflects && wide < 1.0 ? (alpha < MIN_ALPHA ? 1u : LOBE_RAYS) : 0u;
    for (uint i = 0u; i < mirrored_rays + (transmits ? 1u : 0u); i++) {
        bool mirrors = i < mirrored_rays;
        vec3 way = d;
        if (mirrors && alpha >= MIN_ALPHA) {
            vec2 u = vec2(fract(0.381966011 * float(i) + shift.x), (float(i) + shift.y) / float(mirrored_rays));
            vec3 h = basis * visible_normal(alpha, v.view * basis, u);
            way = above_facet(reflect(-v.view, h), s.facet);
        }
        vec3 weight = v.lobes.specular * ((1.0 - wide) / float(max(mirrored_rays, 1u)));
        if (!mirrors) {
            way = refraction_direction(-v.view, s.normal, s.ior, v.back, s.thickness_m <= 0.0);
            weight = s.transmitted * v.lobes.rest;
        }
        float bright = mirrors ? 1.0 - lamps_in_lobe(s.roughness) : 1.0;
        sent.indirect += weight * seen_along(s.position, s.facet, way, aperture, bright, mirrors ? 1u : 0u);
    }
}
