// Shades the visible part of a triangle in a pixel: direct light at every sample that sees it and, once, the method's
// look-up. With GATHERED, diffuse light comes from the passes gather and share. Needs: push.first_row.
//! per method
//! with GATHERED except none
//! with AOVS
//! given layout(push_constant) uniform Push { uint first_row; } push;

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"
#include "ground/lamp_light.glsl"
#include "ground/image/seen.glsl"
#include "ground/image/gathered.glsl"
#include "ground/image/gathers.glsl"

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
Shown shade(uint triangle, bool back, uvec2 pixel, uint covered, bool nearest) {
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

// `pixel` is in the image. `covered` are its samples that see the triangle. If all do, the pixel's middle is shaded;
// otherwise the middle of these samples, which also lies in the triangle. `nearest`: light is gathered for the nearest
// surfaces of a kind.
Shown shade(uint triangle, bool back, uvec2 pixel, uint covered, bool nearest) {
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
    Viewed viewed = Viewed(view, lobes_towards(s, view), back, bend, vec3(0.0));
    bool lit = !s.unlit;
    vec3 direct = s.emitted;
    if (feature(FEATURE_CLEARCOAT)) {
        direct *= 1.0 - viewed.lobes.coat;
    }
#ifndef ASKS
    if (lit) {
        direct += lights_directly(s, a, pixel, covered, viewed.lobes.diffuse);
        // This runs twice for a coat: for the surface under it, and for the coat.
        for (uint layer = 0u; layer < (FINDS_LAMPS ? 0u : feature(FEATURE_CLEARCOAT) ? 2u : 1u); layer++) {
            direct += lamps_along_rays(layer == 0u ? s : coat_of(s), layer == 0u ? viewed : coat_viewed(viewed));
        }
    }
#endif
    Gathered gathered = nothing_gathered();
#ifdef GATHERED
    for (uint i = 0u; i < (nearest ? 1u : 0u); i++) {
        gathered = gathered_nearby(pixel, s.position, s.normal, narrowest_alpha(s));
    }
#endif
    // A surface that no gathered pixel shows computes its own look-up, a surface at an edge its own lamps, and so does
    // every far side, which is not gathered with neighbours and takes all directions that these would have. These are
    // loops, which a CPU device leaves early, and which name each look-up once, because drivers inline it at every
    // call.
    Outgoing through = Outgoing(vec3(0.0), vec3(0.0));
    uint near = lit && !gathered.found ? 1u : 0u;
    // A metal's reflection of lamps varies more from pixel to pixel than its other reflection.
    uint near_lamps = lit && !(gathered.found_lamps && gathered.found_lamp_lobes && scatters(s)) ? 1u : 0u;
    uint far = lit && sends_through(s) ? 1u : 0u;
    for (uint i = 0u; i < near_lamps + far; i++) {
        LampLight lamps = no_lamp_light();
#ifndef ASKS
        lamps = lamp_light(i < near_lamps ? s : far_side(s), view);
#endif
        if (i < near_lamps) {
            lamps.diffuse = gathered.found_lamps ? gathered.lamps.diffuse : lamps.diffuse;
            gathered.lamps = lamps;
        } else {
            through.direct = lamps.diffuse;
        }
    }
#ifndef AOVS
    near = gathers(s) ? near : 0u;
#endif
    const uint places = INTERLEAVE * INTERLEAVE;
    for (uint i = 0u; i < near + places * far; i++) {
        uint k = i - near;
        uvec3 place = i < near ? uvec3(pixel, 0u) : uvec3(k % INTERLEAVE, k / INTERLEAVE, 0u);
#ifdef METHOD_GATHERS_LOBES
        vec3 mirrored;
        vec4 light = look_up_for_view(i < near ? s : far_side(s), view, place, gathered.crumb, mirrored);
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
    Outgoing sent = Outgoing(direct, vec3(0.0));
    if (lit) {
        sent.direct += s.diffuse * viewed.lobes.diffuse * gathered.lamps.diffuse + gathered.lamps.specular;
        sent.indirect = s.diffuse * viewed.lobes.diffuse * gathered.light.rgb;
        viewed.gathered = gathered.mirrored;
        if (feature(FEATURE_SHEEN)) {
            sent.indirect += viewed.lobes.sheen * gathered.light.rgb;
        }
        if (sends_through(s)) {
            vec3 share = s.finish.diffused * viewed.lobes.diffuse;
            sent.direct += share * through.direct;
            sent.indirect += share * through.indirect;
        }
        for (uint layer = 0u; layer < (feature(FEATURE_CLEARCOAT) ? 2u : 1u); layer++) {
            Surface glossy = under_layers(s, viewed);
            Viewed seen = viewed;
            if (layer > 0u) {
                glossy = coat_of(s);
                seen = coat_viewed(viewed);
                // The specular light was gathered for the surface under the coat.
                seen.gathered = seen.lobes.specular * gathered.light.rgb;
            }
            add_glossy(sent, glossy, seen);
        }
    }
    direct = sent.direct;
    vec3 indirect = sent.indirect / frame.scale;
    return shown_as(s, direct, indirect, gathered.light.a);
}
#endif
