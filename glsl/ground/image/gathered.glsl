// Results of the passes gather and share, brought up to the size of the image. Needs: push.first_row.
//! with GATHERED
//! with METHOD_GATHERS_LOBES
//! given layout(push_constant) uniform Push { uint first_row; } push;

#include "ground/image/likeness.glsl"
#include "ground/lamp_light.glsl"

struct Gathered {
    vec4 light; // E/π in stored radiance; open share of the hemisphere
    LampLight lamps;
    bool found;
    vec3 mirrored; // stored radiance of the specular lobe, where a method gathers for it
};

Gathered nothing_gathered() {
    return Gathered(vec4(0.0, 0.0, 0.0, 1.0), LampLight(vec3(0.0), vec3(0.0)), false, vec3(0.0));
}

#ifdef GATHERED
uniform sampler2D shared_light;
uniform sampler2D shared_lamps; // stored radiance, diffuse and specular
uniform sampler2D shared_lamps_specular;
#ifdef METHOD_GATHERS_LOBES
uniform sampler2D shared_mirrored;
#endif
uniform sampler2D surfaces; // position, packed normal

const float LEAST_LIKENESS = 1e-3;
// Gathered pixels beyond the four about a pixel that are looked at where none of these shows its surface.
const int WIDER = 2;
// Rows that a band gathers above and below its own, so that no neighbour is missing.
const uint GATHER_MARGIN = INTERLEAVE / 2u + 1u + uint(WIDER);

// The light of the gathered pixels about this one that lie on the same surface: of the four nearest, or, where these
// show others, of those about them. At edges and among small triangles that is less noise than a few rays of the
// pixel's own, and cheaper.
Gathered gathered_nearby(uvec2 pixel, vec3 position, vec3 normal) {
    uvec2 image = uvec2(frame.image_size);
    ivec2 size = ivec2((image + GATHER_SCALE - 1u) / GATHER_SCALE);
    int first_row = max(int(push.first_row / GATHER_SCALE) - int(GATHER_MARGIN), 0);
    vec2 at = (vec2(pixel) + 0.5) / frame.image_size * vec2(size) - 0.5;
    ivec2 corner = ivec2(floor(at));
    vec2 part = at - vec2(corner);
    Gathered sum = nothing_gathered();
    sum.light = vec4(0.0);
    float total = 0.0;
    const int side = 2 * WIDER + 2;
    int count = 4;
    for (int k = 0; k < count; k++) {
        ivec2 step = k < 4 ? ivec2(k & 1, k >> 1) : ivec2((k - 4) % side, (k - 4) / side) - WIDER;
        ivec2 texel = clamp(corner + step, ivec2(0), size - 1) - ivec2(0, first_row);
        vec4 there = texelFetch(surfaces, texel, 0);
        vec2 away = abs(vec2(step) - part);
        float close = k < 4 ? (1.0 - away.x) * (1.0 - away.y) : 1.0 / (1.0 + dot(away, away));
        float weight = there.w < 0.0 ? 0.0 : likeness(position, normal, there.xyz, unpack_normal(there.w));
        weight *= close;
        total += weight;
        count += k == 3 && total <= LEAST_LIKENESS ? side * side : 0;
        sum.light += weight * texelFetch(shared_light, texel, 0);
        if (LAMPS == LAMPS_SAMPLED) {
            sum.lamps.diffuse += weight * texelFetch(shared_lamps, texel, 0).rgb;
            sum.lamps.specular += weight * texelFetch(shared_lamps_specular, texel, 0).rgb;
        }
#ifdef METHOD_GATHERS_LOBES
        if (feature(FEATURE_SPECULAR)) {
            sum.mirrored += weight * texelFetch(shared_mirrored, texel, 0).rgb;
        }
#endif
    }
    sum.found = total > LEAST_LIKENESS;
    float mean = sum.found ? 1.0 / total : 0.0;
    sum.light *= mean;
    sum.mirrored *= mean;
    sum.lamps.diffuse *= mean / frame.scale;
    sum.lamps.specular *= mean / frame.scale;
    return sum;
}
#endif
