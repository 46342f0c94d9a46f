// Shades the visible part of a triangle in a pixel: direct light at every sample that sees it and, once, the method's
// look-up. With GATHERED, diffuse light comes from the passes gather and share. Needs: push.first_row, PARTS.
//! per method
//! with GATHERED except none
//! with AOVS
//! given layout(push_constant) uniform Push { uint first_row; } push; const uint PARTS = 7u;

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"
#include "ground/lamp_light.glsl"
#include "ground/image/seen.glsl"
#include "ground/image/gathered.glsl"
#include "ground/image/gathers.glsl"

// The parts of a fragment's light, of which PARTS are shaded. Parts that few fragments need are passes of their own.
const uint PART_LIGHT = 1u; // direct and gathered light, and all other layers
const uint PART_LOOK_UPS = 2u; // look-ups and lamps of the fragment's own, where gathered light is missing
const uint PART_LOBES = 4u; // specular reflection and transmission

// A macro, like `feature`.
#define has_part(part) ((PARTS & (part)) != 0u)

// The further parts that a fragment needs. PART_LIGHT finds them.
const uint NEEDS_LIGHT = 1u; // a look-up of its own
const uint NEEDS_LAMPS = 2u; // lamps of its own: their specular reflection, or with the next bit all of their light
const uint NEEDS_DIFFUSE_LAMPS = 4u;
const uint NEEDS_FAR_SIDE = 8u;
const uint NEEDS_FEW_RAYS = 16u; // the fragment lies among crumbs
const uint NEEDS_LOOK_UPS = NEEDS_LIGHT | NEEDS_LAMPS | NEEDS_FAR_SIDE; // any of these needs PART_LOOK_UPS
const uint NEEDS_LOBES = 32u; // PART_LOBES
const uint NEEDS_BITS = 6u;

// Radiance, premultiplied by opacity, and the further layers.
struct Shown {
    vec4 beauty;
#ifdef AOVS
    vec4 direct;
    vec4 indirect;
    vec4 normal;
    vec4 albedo;
    vec4 ao_depth_diffuse;
#endif
};

// The layers of a surface's pixel. `open` is the unoccluded share of the hemisphere.
Shown shown_as(Surface s, vec3 direct, vec3 indirect, float open) {
    float opacity = s.opacity;
    Shown shown;
    shown.beauty = vec4((direct + indirect) * opacity, opacity);
#ifdef AOVS
    shown.direct = vec4(direct * opacity, opacity);
    shown.indirect = vec4(indirect * opacity, opacity);
    shown.normal = vec4(s.normal * opacity, opacity);
    float depth = dot(s.position - frame.eye, frame.forward) * frame.voxel_m;
    shown.albedo = vec4(s.albedo * opacity, opacity);
    shown.ao_depth_diffuse = vec4(vec3(open, depth, s.diffuse_share) * opacity, opacity);
#endif
    return shown;
}

#ifdef METHOD_SHADES
// The method computes all light by itself, from one of the covered samples, each equally often.
Shown shade(uint triangle, bool back, uvec2 pixel, uint covered, bool nearest, inout uint needs) {
    Triangle t = triangles[triangle];
    Attributes attributes = attributes_of(triangle);
    COUNT(TRIANGLES, 1u);
    vec3 facet = normalize(triangle_normal(t.corners[0], t.corners[1], t.corners[2]));
    uint skipped = method_sample(pixel) % uint(max(bitCount(covered), 1));
    for (uint k = 0u; k < skipped; k++) {
        covered &= covered - 1u;
    }
    vec3 weights = seen_weights(vec2(pixel) + sample_place(uint(max(findLSB(covered), 0))), t, facet);
    Surface s = evaluate_surface(t, attributes, weights, POINT, back);
    vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
    MethodLight light = method_shades(SeenSurface(triangle, back, weights, view), pixel);
    float open = 1.0;
#ifdef AOVS
    open = method_open_share(s, pixel);
#endif
    return shown_as(s, light.direct, light.indirect, open);
}
#else
// Direct light, averaged over the covered samples or at the surface's point. `through_share` is the share that Fresnel
// and layers leave for light scattered to the far side.
vec3 lights_directly(Surface s, vec3 a, uvec2 pixel, uint covered, float through_share) {
    vec3 sum = vec3(0.0);
    covered = feature(FEATURE_DIRECT_PER_PIXEL) ? 1u : covered;
    uint count = uint(bitCount(covered));
    uint part = 0u;
    for (uint left = covered; left != 0u; left &= left - 1u) {
        uint i = uint(findLSB(left));
        vec3 position =
            feature(FEATURE_DIRECT_PER_PIXEL) ? s.position : seen_point(vec2(pixel) + sample_place(i), a, s.facet);
        vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - position);
        for (uint k = 0u; k < frame.light_count; k++) {
            LightSample to = sample_light(lights[k], position, frame.voxel_m);
            // Single rays find the sky's lights in smooth surfaces, so lobes leave them out.
            vec3 reflected = to.irradiance * brdf_cos(s, view, to.direction, lights[k].kind == LIGHT_SKY);
            Surface lit = s;
            if (sends_through(s) && dot(s.normal, to.direction) < 0.0) {
                lit = far_side(s);
                reflected = to.irradiance * s.finish.diffused * (through_share / PI * dot(lit.normal, to.direction));
            }
            if (any(greaterThan(reflected, vec3(0.0)))) {
                sum += reflected * shadow_towards(lights[k], to, lit, position, part, count);
            }
        }
        part++;
    }
    return sum / float(max(count, 1u));
}

// The change of the shading normal over half a pixel in radians, without normal maps.
float normal_bend(Attributes attributes, PlaceOnTriangle at) {
    return 0.5 * max(length(attributes.normals * at.across), length(attributes.normals * at.down));
}

// Whether PART_LOBES adds to a surface.
bool looks_in_lobes(Surface s, Viewed v) {
#ifdef METHOD_GATHERS_LOBES
    bool reflects = mirrored_rays(s, v.lobes) > 0u;
#else
    bool reflects = feature(FEATURE_SPECULAR) && any(greaterThan(v.lobes.specular, vec3(0.0)));
#endif
    return reflects || (feature(FEATURE_TRANSMISSION) && s.transmission > 0.0);
}

// The needs of a lit surface beyond the light that was gathered for it.
uint needs_of(Surface s, Viewed v, Gathered gathered) {
    uint needs = sends_through(s) ? NEEDS_FAR_SIDE : 0u;
    bool near = !gathered.found;
#ifndef AOVS
    near = near && gathers(s);
#endif
    needs |= near ? NEEDS_LIGHT : 0u;
    needs |= gathered.crumb ? NEEDS_FEW_RAYS : 0u;
#ifndef ASKS
    if (LAMPS == LAMPS_SAMPLED) {
        // A metal's reflection of lamps varies more from pixel to pixel than its other reflection.
        bool shares_lamps = gathered.found_lamps && gathered.found_lamp_lobes && scatters(s);
        needs |= shares_lamps ? 0u : NEEDS_LAMPS;
        needs |= gathered.found_lamps ? 0u : NEEDS_DIFFUSE_LAMPS;
    }
#endif
    bool lobes = looks_in_lobes(under_layers(s, v), v);
    if (feature(FEATURE_CLEARCOAT)) {
        lobes = lobes || looks_in_lobes(coat_of(s), coat_viewed(v));
    }
    return needs | (lobes ? NEEDS_LOBES : 0u);
}

// The look-ups that a fragment needs for itself, in place of gathered light; returns the light on its far side. These
// are loops, which a CPU device leaves early, and which name each look-up once, because drivers inline it at every
// call.
Outgoing look_up_itself(inout Gathered gathered, uint needs, Surface s, vec3 view, uvec2 pixel) {
    Outgoing through = Outgoing(vec3(0.0), vec3(0.0));
    uint near_lamps = (needs & NEEDS_LAMPS) != 0u ? 1u : 0u;
    uint near = (needs & NEEDS_LIGHT) != 0u ? 1u : 0u;
    uint far = (needs & NEEDS_FAR_SIDE) != 0u ? 1u : 0u;
    for (uint i = 0u; i < near_lamps + far; i++) {
        LampLight lamps = no_lamp_light();
#ifndef ASKS
        lamps = lamp_light(i < near_lamps ? s : far_side(s), view);
#endif
        if (i < near_lamps) {
            lamps.diffuse = (needs & NEEDS_DIFFUSE_LAMPS) != 0u ? lamps.diffuse : gathered.lamps.diffuse;
            gathered.lamps = lamps;
        } else {
            through.direct = lamps.diffuse;
        }
    }
    // A far side is not gathered with neighbours, so it takes all directions that these would have.
    const uint places = INTERLEAVE * INTERLEAVE;
    for (uint i = 0u; i < near + places * far; i++) {
        uint k = i - near;
        uvec3 place = i < near ? uvec3(pixel, 0u) : uvec3(k % INTERLEAVE, k / INTERLEAVE, 0u);
#ifdef METHOD_GATHERS_LOBES
        vec3 mirrored;
        bool few = (needs & NEEDS_FEW_RAYS) != 0u;
        vec4 light = look_up_for_view(i < near ? s : far_side(s), view, place, few, mirrored);
        gathered.mirrored = i < near ? mirrored : gathered.mirrored;
#else
        vec4 light = look_up_diffuse(i < near ? s : far_side(s), place);
#endif
        if (i < near) {
            gathered.light = light;
        } else {
            through.indirect += light.rgb / float(places);
        }
    }
    return through;
}

// `pixel` is in the image. `covered` are its samples that see the triangle. If all do, the pixel's middle is shaded;
// otherwise the middle of these samples, which also lies in the triangle. `nearest`: light is gathered for the nearest
// surfaces of a kind. `needs` is found with PART_LIGHT, and given otherwise.
Shown shade(uint triangle, bool back, uvec2 pixel, uint covered, bool nearest, inout uint needs) {
    Triangle t = triangles[triangle];
    Attributes attributes = attributes_of(triangle);
    COUNT(TRIANGLES, 1u);
    vec3 a = t.corners[0];
    vec3 facet = normalize(triangle_normal(a, t.corners[1], t.corners[2]));
    vec2 middle = vec2(0.5);
    if (covered != (1u << frame.samples) - 1u) {
        middle = vec2(0.0);
        for (uint i = 0u; i < frame.samples; i++) {
            middle += (covered & 1u << i) != 0u ? sample_place(i) / float(bitCount(covered)) : vec2(0.0);
        }
    }
    PlaceOnTriangle at = place_on_triangle(vec2(pixel) + middle, vec2(1.0), t, facet);
    float bend = normal_bend(attributes, at);
    Surface s = evaluate_surface(t, attributes, at.weights, pixel_footprint(attributes, at), back);
    vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
    Viewed viewed = Viewed(view, lobes_towards(s, view), back, bend);
    bool lit = !s.unlit;
    Gathered gathered = nothing_gathered();
    gathered.light.a = has_part(PART_LIGHT) ? 1.0 : 0.0; // parts add up
    Outgoing sent = Outgoing(vec3(0.0), vec3(0.0));
    if (has_part(PART_LIGHT)) {
        sent.direct = s.emitted;
        if (feature(FEATURE_CLEARCOAT)) {
            sent.direct *= 1.0 - viewed.lobes.coat;
        }
#ifndef ASKS
        if (lit) {
            sent.direct += lights_directly(s, a, pixel, covered, viewed.lobes.diffuse);
        }
#endif
#ifdef GATHERED
        for (uint i = 0u; i < (nearest ? 1u : 0u); i++) {
            gathered = gathered_nearby(pixel, s.position, s.normal, narrowest_alpha(s));
        }
#endif
        needs = lit ? needs_of(s, viewed, gathered) : 0u;
        // The parts that follow add these.
        gathered.light *= (needs & NEEDS_LIGHT) != 0u ? 0.0 : 1.0;
        gathered.lamps.diffuse *= (needs & NEEDS_DIFFUSE_LAMPS) != 0u ? 0.0 : 1.0;
        gathered.lamps.specular *= (needs & NEEDS_LAMPS) != 0u ? 0.0 : 1.0;
    }
    Outgoing through = Outgoing(vec3(0.0), vec3(0.0));
    if (has_part(PART_LOOK_UPS)) {
        through = look_up_itself(gathered, needs, s, view, pixel);
    }
    if (lit && has_part(PART_LIGHT | PART_LOOK_UPS)) {
        sent.direct += s.diffuse * viewed.lobes.diffuse * gathered.lamps.diffuse + gathered.lamps.specular;
        sent.indirect = s.diffuse * viewed.lobes.diffuse * gathered.light.rgb;
        if (feature(FEATURE_SHEEN)) {
            sent.indirect += viewed.lobes.sheen * gathered.light.rgb;
        }
        if (sends_through(s)) {
            vec3 share = s.finish.diffused * viewed.lobes.diffuse;
            sent.direct += share * through.direct;
            sent.indirect += share * through.indirect;
        }
#ifdef METHOD_GATHERS_LOBES
        sent.indirect += gathered_share(under_layers(s, viewed), viewed.lobes) * gathered.mirrored;
        if (feature(FEATURE_CLEARCOAT)) {
            // The specular light was gathered for the surface under the coat.
            Lobes coat = coat_lobes(viewed.lobes);
            sent.indirect += gathered_share(coat_of(s), coat) * coat.specular * gathered.light.rgb;
        }
#endif
    }
    if (has_part(PART_LOBES)) {
        // This runs twice for a coat: for the surface under it, and for the coat.
        uint layers = !lit ? 0u : feature(FEATURE_CLEARCOAT) ? 2u : 1u;
        for (uint layer = 0u; layer < layers; layer++) {
            Surface glossy = layer == 0u ? s : coat_of(s);
            Viewed seen = layer == 0u ? viewed : coat_viewed(viewed);
#ifndef ASKS
            sent.direct += FINDS_LAMPS ? vec3(0.0) : lamps_along_rays(glossy, seen);
#endif
            add_glossy(sent, layer == 0u ? under_layers(s, viewed) : glossy, seen);
        }
    }
    return shown_as(s, sent.direct, sent.indirect / frame.scale, gathered.light.a);
}
#endif
