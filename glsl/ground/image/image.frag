#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_post_depth_coverage : require
//! per method
//! with GATHERED except none
//! with AOVS
// Image: shades each pixel with direct light at every covered sample and, once per pixel, with what the method looks up.
// With GATHERED, diffuse light comes from the passes gather and share. Writes radiance, premultiplied by opacity.

#include "ground/constants.glsl"
#include "ground/surface.glsl"
#include "ground/brdf.glsl"
#include "method/look_up.glsl"
#include "ground/lamp_light.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
} push;

#include "ground/image/gathered.glsl"
#include "ground/image/mask.glsl"

layout(early_fragment_tests) in; // depth is there already
layout(post_depth_coverage) in; // a sample that a nearer surface hides may lie beyond a wall; left out where a device lacks it

layout(location = 0) in vec3 in_weights;
layout(location = 1) centroid in vec3 in_centroid_weights;
layout(location = 2) flat in uint in_triangle;
layout(location = 3) flat in uint in_back;

layout(location = 0) out vec4 out_beauty;
#ifdef AOVS
layout(location = 1) out vec4 out_direct;
layout(location = 2) out vec4 out_indirect;
layout(location = 3) out vec4 out_normal;
layout(location = 4) out vec4 out_albedo;
layout(location = 5) out vec4 out_ao_depth_diffuse;
#endif

// Light that arrives without a bounce, averaged over the covered samples or from the surface's point. `through_share`: what
// Fresnel and layers leave of what is scattered to the far side.
vec3 direct_light(Surface s, vec3 a, uint covered, float through_share) {
    vec3 sum = vec3(0.0);
    covered = feature(FEATURE_DIRECT_PER_PIXEL) ? 1u : covered;
    uint count = uint(bitCount(covered));
    uint part = 0u;
    for (uint left = covered; left != 0u; left &= left - 1u) {
        uint i = uint(findLSB(left));
        vec3 position = feature(FEATURE_DIRECT_PER_PIXEL) ? s.position : sample_position(i, a, s.facet);
        vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - position);
        for (uint k = 0u; k < frame.light_count; k++) {
            LightSample to = sample_light(lights[k], position, frame.voxel_m);
            // What is smooth mirrors the sky itself.
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

void main() {
    Triangle t = triangles[in_triangle];
    Attributes attributes = attributes_of(in_triangle);
    COUNT(TRIANGLES, 1u);
    Footprint footprint = pixel_footprint(attributes, in_weights);
    float bend = normal_bend(attributes, in_weights);
    vec3 a = t.corners[0];
    uint covered = covered_samples(t, attributes, footprint);
    // llvmpipe interpolates at the centroid with the 1/w of the pixel's middle: the weights' sum is not 1, and the point
    // not on the plane.
    vec3 weights = in_centroid_weights / (in_centroid_weights.x + in_centroid_weights.y + in_centroid_weights.z);
    if (feature(FEATURE_MASK) && (materials[t.material].flags & MATERIAL_MASK) != 0u && covered != 0u) {
        // The middle of what the outline covers may lie in a hole.
        vec3 b = t.corners[1];
        vec3 c = t.corners[2];
        vec2 bc = barycentric(a, b, c, sample_position(uint(findLSB(covered)), a, normalize(triangle_normal(a, b, c))));
        weights = vec3(1.0 - bc.x - bc.y, bc);
    }
    Surface s = evaluate_surface(t, attributes, weights, footprint, in_back != 0u);
    vec3 view = frame.orthographic != 0u ? -frame.forward : normalize(frame.eye - s.position);
    Viewed viewed = Viewed(view, lobes_towards(s, view), in_back != 0u, bend, vec3(0.0));
    bool lit = !s.unlit;
    vec3 direct = s.emitted;
    if (feature(FEATURE_CLEARCOAT)) {
        direct *= 1.0 - viewed.lobes.coat;
    }
    if (lit) {
        direct += direct_light(s, a, covered, viewed.lobes.diffuse);
        // With a coat twice: what lies under it, and itself.
        for (uint layer = 0u; layer < (FINDS_LAMPS ? 0u : feature(FEATURE_CLEARCOAT) ? 2u : 1u); layer++) {
            direct += lamps_along_rays(layer == 0u ? s : coat_of(s), layer == 0u ? viewed : coat_viewed(viewed));
        }
    }
#ifdef GATHERED
    Gathered gathered = gathered_nearby(s.position, s.normal);
#else
    Gathered gathered = nothing_gathered();
#endif
    // A surface of which no gathered pixel shows anything looks up for itself, and so does every far side: that is not gathered
    // with neighbours, so it takes all directions that these would have. Loops, which a CPU device leaves early, name each
    // look-up once: drivers copy it into every place that calls it.
    Outgoing through = Outgoing(vec3(0.0), vec3(0.0));
    uint near = lit && !gathered.found ? 1u : 0u;
    uint far = lit && sends_through(s) ? 1u : 0u;
    for (uint i = 0u; i < near + far; i++) {
        LampLight lamps = lamp_light(i < near ? s : far_side(s), view);
        if (i < near) {
            gathered.lamps = lamps;
        } else {
            through.direct = lamps.diffuse;
        }
    }
#ifndef AOVS
    near = scatters(s) ? near : 0u;
#endif
    const uint places = INTERLEAVE * INTERLEAVE;
    for (uint i = 0u; i < near + places * far; i++) {
        uint k = i - near;
        uvec3 place = i < near ? uvec3(gl_FragCoord.xy, 0u) + uvec3(0u, push.first_row, 0u) : uvec3(k % INTERLEAVE, k / INTERLEAVE, 0u);
#ifdef METHOD_GATHERS_LOBES
        vec3 mirrored;
        vec4 light = look_up_for_view(i < near ? s : far_side(s), view, place, mirrored);
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
                seen.gathered = seen.lobes.specular * gathered.light.rgb; // what is mirrored was gathered for what lies under it
            }
            add_glossy(sent, glossy, seen);
        }
    }
    direct = sent.direct;
    vec3 indirect = sent.indirect / frame.scale;
    float opacity = s.opacity;
    out_beauty = vec4((direct + indirect) * opacity, opacity);
#ifdef AOVS
    out_direct = vec4(direct * opacity, opacity);
    out_indirect = vec4(indirect * opacity, opacity);
    out_normal = vec4(s.normal * opacity, opacity);
    float depth = dot(s.position - frame.eye, frame.forward) * frame.voxel_m;
    out_albedo = vec4(s.albedo * opacity, opacity);
    out_ao_depth_diffuse = vec4(vec3(gathered.light.a, depth, s.diffuse_share) * opacity, opacity);
#endif
}
