// Stored radiance of the sky: uniform, graded, or a map. src/scene/sky/ makes the data of a map; src/scene/sky/mod.rs
// and tests/device/sky_map.rs have its CPU twin.

#include "common/numbers.glsl"
#include "ground/constants.glsl"
#include "ground/frame.glsl"

// A texel, RGB9E5.
vec3 sky_texel(uint word) {
    uint packed = sky_words[word];
    vec3 channels = vec3((uvec3(packed) >> uvec3(0u, 9u, 18u)) & 511u);
    return channels * uintBitsToFloat(((packed >> 27) + 103u) << 23);
}

// Bilinear interpolation of the four texels around a position of the map that begins at word `first`; brighter texels
// are dimmed to `most`.
vec3 sky_between(uint first, int width, int height, vec2 place, float most) {
    vec2 at = place * vec2(width, height) - 0.5;
    vec2 corner = floor(at);
    vec2 part = at - corner;
    vec3 rows[2];
    for (int k = 0; k < 2; k++) {
        int y = clamp(int(corner.y) + k, 0, height - 1);
        vec3 pair[2];
        for (int j = 0; j < 2; j++) {
            int x = int(corner.x) + j;
            x += x < 0 ? width : x >= width ? -width : 0;
            vec3 texel = sky_texel(first + uint(y * width + x));
            float largest = max(texel.r, max(texel.g, texel.b));
            pair[j] = largest > most ? texel * (most / largest) : texel;
        }
        rows[k] = pair[0] + (pair[1] - pair[0]) * part.x;
    }
    return rows[0] + (rows[1] - rows[0]) * part.y;
}

// The position of unit d: across and down from 0 to 1.
vec2 sky_place(vec3 d) {
    float out_of_axis = length(d.xz);
    float turn = out_of_axis > 0.0 ? atan(d.z, d.x) / (2.0 * PI) : 0.0;
    return vec2(fract(0.5 + turn + frame.sky_turn), atan(out_of_axis, d.y) / PI);
}

const float WIDEST = 1.2309594; // acos(1/3): a cone of that half angle has the mean direction of a cosine lobe

// The level whose cones have that tangent of their half angle; the map itself follows the last level.
float sky_level(float aperture) {
    float angle = atan(max(aperture, 1e-6));
    if (angle > PI / 4.0) {
        return max((WIDEST - angle) / (WIDEST - PI / 4.0), 0.0);
    }
    float last = float(frame.sky_levels - 1u);
    float level = 1.0 + log2(PI / 4.0 / angle);
    return level < last ? level : last + min((level - last) / frame.sky_octaves, 1.0);
}

// Means over cones of that aperture, without the bright part.
vec3 sky_mean(vec2 place, float aperture) {
    float level = sky_level(aperture);
    uint fine = uint(level);
    float share = level - float(fine);
    vec3 sum = vec3(0.0);
    for (uint k = fine; k < (share > 0.0 ? fine + 2u : fine + 1u); k++) {
        bool whole = k >= frame.sky_levels;
        int rows = 16 << max(int(k), 1) >> 1;
        uint size = uint(frame.sky_width * frame.sky_height);
        uint first = k == 0u ? size : size + 512u + 128u * ((1u << 2u * k) - 4u) / 3u;
        vec3 found = whole ? sky_between(0u, frame.sky_width, frame.sky_height, place, frame.sky_most)
                           : sky_between(first, 2 * rows, rows, place, frame.sky_most);
        sum = k == fine ? found : sum + (found - sum) * share;
    }
    return sum;
}

// Radiance towards unit d at full resolution.
vec3 sky_towards(vec3 d) {
    if (feature(FEATURE_SKY_MAP)) {
        return sky_between(0u, frame.sky_width, frame.sky_height, sky_place(d), 1e30) * (frame.sky_scale * frame.scale);
    }
    return (frame.sky + frame.sky_gradient * d.y) * frame.scale;
}

// The mean over a cone about unit d; `aperture` is the tangent of its half angle. `bright` is the share of the map's
// bright part that the look-up includes; lights send the rest.
vec3 sky_about(vec3 d, float aperture, float bright) {
    if (feature(FEATURE_SKY_MAP)) {
        vec2 place = sky_place(d);
        vec3 found = sky_mean(place, aperture);
        if (bright > 0.0) {
            found += bright
                * (sky_between(0u, frame.sky_width, frame.sky_height, place, 1e30)
                    - sky_between(0u, frame.sky_width, frame.sky_height, place, frame.sky_most));
        }
        return found * (frame.sky_scale * frame.scale);
    }
    return sky_towards(d);
}

// Irradiance/π of a surface with unit normal n under the unoccluded sky, without the bright part.
vec3 sky_over(vec3 n) {
    const float MEAN_COSINE_OF_SKY = 0.6666667; // of a uniform sky's light on a surface
    if (feature(FEATURE_SKY_MAP)) {
        return sky_about(n, 1e6, 0.0);
    }
    return sky_towards(MEAN_COSINE_OF_SKY * n);
}

// Tangent of the half angle of the cone that one of `count` cosine-distributed directions at `cosine` represents; such
// directions do not resolve the sky more finely.
float share_aperture(uint count, float cosine) {
    float versine = min(0.5 / (float(count) * max(cosine, 1e-3)), 0.99);
    return sqrt(versine * (2.0 - versine)) / (1.0 - versine);
}
