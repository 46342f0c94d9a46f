// Light that a glossy surface reflects or that is seen through glass, along exact rays.

#include "common/directions.glsl"
#include "common/lobe.glsl"
#include "ground/place_random.glsl"
#include "ground/brdf.glsl"
#include "ground/sky.glsl"
#include "gi/rays/ray_light.glsl"
#include "gi/rays/lobe_rays.glsl"

// The maximum number of partly transparent surfaces that one ray meets.
const uint MOST_INTERFACES = 64u;

// The texture's value where a ray of that width (voxels) hits `at`, over its mean over the surrounding voxels: mirrors
// and glass show patterns that are finer than the stored light.
vec3 texture_detail(Met met, Material m, vec3 at, float width) {
    if (!slot_in_use(SLOT_BASE_COLOR) || any(greaterThan(m.emissive, vec3(0.0)))) {
        return vec3(1.0);
    }
    Attributes attributes = attributes_of(met.place);
    float scale = box_at(at).scale;
    Footprint blurred = footprint_over(attributes, corners_of(met.triangle) * scale);
    float share = clamp(width * scale, 0.0, 1.0);
    Footprint sharp = Footprint(mat2[2](share * blurred.uv[0], share * blurred.uv[1]));
    vec4 uv = between(attributes.uvs, met.weights);
    vec4 color = between(attributes.colors, met.weights);
    return base_color(m, uv, color, sharp).rgb / max(base_color(m, uv, color, blurred).rgb, vec3(1e-3));
}

struct Seen {
    vec3 light; // stored radiance, including the sky behind it
    vec3 lamps; // radiance of sampled lamps, whose light items do not store: the share of rays
};

// Cosine on the side of air for light at cosine c; −1 for total reflection.
float cosine_in_air(float c, float ior, bool inside) {
    float sine2 = inside ? (1.0 - c * c) * ior * ior : 1.0 - c * c;
    return sine2 < 1.0 ? sqrt(1.0 - sine2) : inside ? -1.0 : 0.0;
}
// The share of a metal's reflection that is sharp. Its items store that share as diffuse light; a ray that should show
// it sharply continues in the mirror direction instead.
float mirror_share(Surface s) {
    float metal = 1.0 - s.diffuse_share - s.transmission;
    float rough = smoothstep(0.5 * LEAST_ITEM_ALPHA, LEAST_ITEM_ALPHA, s.roughness * s.roughness);
    return !s.unlit && s.opacity == 1.0 && s.transmission == 0.0 ? metal * (1.0 - rough) : 0.0;
}

// The share of an item's light that was reflected specularly.
float mirrored_in_item(Surface s) {
    Lobes lobes = lobes_at(s, MEAN_COSINE);
    float glossy = brightest(lobes.specular);
    return glossy / max(glossy + brightest(s.diffuse * lobes.diffuse), 1e-6);
}

// Reflects d in place; returns the specular weight.
vec3 go_on_mirrored(Surface s, inout vec3 d) {
    vec3 sent_on = lobes_towards(s, -d).specular;
    d = above_facet(reflect(d, normal_against(s.normal, d)), s.facet);
    return sent_on;
}

// Light along unit d from a surface with normal `facet`. Glass with a thickness refracts at entry and exit, or reflects
// totally, and absorbs by Beer's law in between; its other reflections are assumed to be as bright as the light through
// it. `aperture` is the tangent of the ray's half angle. `bright` is as for sky_about, and for mirrors also the share
// that is shown sharply. Without `sends` the result is black. With `views` the ray continues a view ray, to which
// single-sided backs are invisible. `mirrors` counts mirrors between the eye and this point. `rays` is the number of
// rays per steradian, or SHARP if they find all lamp light and points on lamps find none. `points` is points on lamps
// over all light.
Seen look_along(vec3 position, vec3 facet, vec3 d, float aperture, float bright, bool sends, bool views, uint mirrors,
    float rays, float points) {
    Seen seen = Seen(vec3(0.0), vec3(0.0));
    vec3 origin = ray_start(position, facet, d);
    vec3 through = vec3(1.0);
    float least = 0.0;
    float travelled = 0.0;
    float pixel = 2.0 * length(frame.down_per_ndc) / frame.image_size.y; // voxels per voxel of distance
    float seen_from = frame.orthographic != 0u ? 0.0 : distance(position, frame.eye);
    bool going = sends;
    for (uint i = 0u; i < (feature(FEATURE_PASSING | FEATURE_MIRRORS) ? MOST_INTERFACES : 1u) && going; i++) {
        Met met = meet(trace_ray(origin, d, least), d);
        seen.light += met.any ? vec3(0.0) : through * sky_about(d, aperture, bright);
        through = met.any ? through : vec3(0.0);
        Material m = materials[met.triangle.material];
        vec3 at = origin + d * met.distance;
        float way = travelled + met.distance;
        float width = 2.0 * aperture * way;
        float pixel_width = frame.orthographic != 0u ? pixel : pixel * (seen_from + way);
        vec3 sent = met.dark || !met.any
            ? vec3(0.0)
            : shown_radiance(met, d, mirrors, width) * texture_detail(met, m, at, max(width, pixel_width));
        Surface s = evaluate_surface(met.triangle, attributes_of(met.place), met.weights, POINT, met.back);
        bool passes = feature(FEATURE_PASSING) && met.triangle.translucent != 0u;
        // A constant if nothing transmits, so that look-ups that only glass needs are omitted.
        float transmission = feature(FEATURE_TRANSMISSION) ? s.transmission : 0.0;
        bool glass = m.thickness_m > 0.0 && transmission > 0.0;
        bool absent = views && met.dark && !glass;
        float mirrored = 0.0;
        float stays = s.opacity * (1.0 - transmission);
        if (feature(FEATURE_MIRRORS)) {
            mirrored = met.any && !met.dark ? bright * mirror_share(s) : 0.0;
            stays *= 1.0 - mirrored * mirrored_in_item(s);
        }
        through *= glass && met.back ? attenuation(m, met.distance * frame.voxel_m) : vec3(1.0);
        seen.light += through * sent * stays;
        vec3 emitted = through * (met.dark || s.unlit ? 0.0 : s.opacity) * s.emitted;
        if (mirrors < 2u) {
            float about = lamp_points_about(brightest(m.emissive), met.normal, way * d, facet, points);
            seen.lamps += emitted * power_share(rays, about);
        } else if (LAMPS == LAMPS_SAMPLED) {
            seen.light += emitted * frame.scale; // the light that it reflects came with a bounce
        }
        vec3 tint = s.albedo * transmission;
        bool turns = glass || mirrored > 0.0;
        float side = 1.0; // side of the facet on which the ray continues
        if (glass) {
            vec3 n = normal_against(s.normal, d);
            float ior = max(s.ior, 1.0);
            vec3 refracted = refract(d, n, met.back ? ior : 1.0 / ior);
            bool reflects = dot(refracted, refracted) < 0.25;
            d = normalize(reflects ? reflect(d, n) : refracted);
            through *= reflects ? vec3(1.0) : tint;
            // If facet and shading normal disagree, the facet decides on which side the ray is.
            d -= (reflects ? 2.0 * min(dot(d, s.facet), 0.0) : 2.0 * max(dot(d, s.facet), 0.0)) * s.facet;
            side = reflects ? 1.0 : -1.0;
        } else if (mirrored > 0.0) {
            through *= mirrored * go_on_mirrored(s, d);
            bright = 1.0;
            mirrors++;
        } else {
            through *= absent ? vec3(1.0) : mix(vec3(1.0), tint, s.opacity);
        }
        origin = turns ? at + s.facet * side * ray_start_at(at) : origin;
        travelled += turns ? met.distance : 0.0;
        least = turns ? 0.0 : met.distance;
        views = views && !turns;
        going =
            met.any && (passes || absent || mirrored > 0.0) && mirrors <= BOUNCES + 1u && brightest(through) >= SPENT;
    }
    return seen;
}

// The ray of a smooth surface has the mirror direction; those of a rough one follow GGX's visible normals.
Outgoing look_in_lobes(Surface s, Viewed viewed) {
    Outgoing sum = Outgoing(vec3(0.0), vec3(0.0));
    vec3 view = viewed.view;
    Lobes lobes = viewed.lobes;
    float alpha = s.roughness * s.roughness;
    float by_rays = 1.0 - gathered_share(s, lobes);
    bool transmits = feature(FEATURE_TRANSMISSION) && s.transmission > 0.0;
    bool thin = s.thickness_m <= 0.0;
    bool inside = viewed.back && !thin;
    float ior = max(s.ior, 1.0);
    vec3 normal = normal_against(s.normal, -view);
    mat3 basis = tangent_frame(normal);
    vec2 alphas = vec2(alpha);
    if (is_brushed(s)) {
        vec3 x = normalize(s.finish.grain - normal * dot(normal, s.finish.grain));
        basis = mat3(x, cross(normal, x), normal);
        alphas = brushed_alphas(s);
    }
    vec3 v = view * basis;
    vec2 shift = place_random(s.position);
    uint mirrored = mirrored_rays(s, lobes);
    mirrored = inside && mirrored > 0u ? lobe_ray_count(alpha, 1.0) : mirrored;
    uint transmitted = transmits ? lobe_ray_count(alpha, s.transmission) : 0u;
    float aperture = ggx_aperture(s.roughness);
    bool finds_lamps = LAMPS == LAMPS_SAMPLED && mirrored > 0u && alpha >= MIN_ALPHA;
    float points = finds_lamps ? points_shared(s) * lamp_points_over_light(s) : 0.0;
    for (uint i = 0u; i < mirrored + transmitted; i++) {
        bool reflects = i < mirrored;
        uint count = reflects ? mirrored : transmitted;
        uint k = reflects ? i : i - mirrored;
        bool smooth_lobe = alpha < MIN_ALPHA;
        // A sunflower pattern on the cap of normals, rotated and shifted from place to place.
        vec2 u = vec2(fract(0.381966011 * float(k) + shift.x), (float(k) + shift.y) / float(count));
        vec3 h = smooth_lobe ? vec3(0.0, 0.0, 1.0) : visible_normal(alphas, v, u);
        float cosine = clamp(dot(v, h), 0.0, 1.0);
        float in_air = cosine_in_air(cosine, ior, inside);
        vec3 fresnel = in_air < 0.0 ? vec3(1.0) : schlick(s.f0, s.f90, in_air);
        float left = in_air < 0.0 ? 0.0 : 1.0 - schlick(s.coat_f0, s.coat_f90, in_air);
        vec3 mirror = 2.0 * cosine * h - v;
        vec3 d = mirror;
        if (!reflects) {
            vec3 refracted = refract(-v, h, inside ? ior : 1.0 / ior);
            d = thin ? vec3(mirror.xy, -mirror.z) : dot(refracted, refracted) > 0.25 ? normalize(refracted) : vec3(0.0);
        }
        float masking = smooth_lobe ? 1.0 : is_brushed(s) ? lobe_masking(alphas, d) : lobe_masking(alpha, abs(d.z));
        vec3 weight = reflects ? fresnel * masking : s.albedo * (s.transmission * left * masking);
        weight /= float(count);
        d = basis * d;
        // Light would have to pass through the reflecting surface, or be refracted to the side from which it came.
        float side = reflects ? 1.0 : -1.0;
        bool sends = side * dot(d, s.facet) > 0.0 && side * dot(d, normal) > 0.0;
        // A curved mirror spreads a pixel by twice the change of its normal; glass may also focus it.
        float spread = reflects ? 2.0 * viewed.bend : 0.0;
        Seen seen = look_along(s.position, s.facet, d, length(vec2(spread, aperture / sqrt(float(count)))),
            reflects ? 1.0 - lamps_in_lobe(s.roughness) : 1.0, sends, !reflects && thin && smooth_lobe,
            reflects ? 1u : 0u, reflects ? mirrored_rays_about(s, lobes, view, d) : SHARP, points);
        sum.indirect += weight * (reflects ? by_rays : 1.0) * seen.light;
        if (LAMPS == LAMPS_SAMPLED) {
            vec3 lamps = weight * seen.lamps;
            sum.direct += reflects || thin ? lamps : vec3(0.0);
            sum.indirect += reflects || thin ? vec3(0.0) : lamps * frame.scale;
        }
    }
    return sum;
}
