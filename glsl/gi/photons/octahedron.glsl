// The octahedral map of 4 × 4 texels: the sixteen directions of a voxel. CPU twin: tests/twins/octahedron.rs.

#include "common/numbers.glsl"
#include "common/octahedron.glsl"

const uint TEXELS = 16u;

// The position of a direction on the map, in texels: 0…4.
vec2 octahedron_place(vec3 d) {
    return 2.0 + 2.0 * octahedron_at(d);
}

vec2 texel_corner(uint texel) {
    return vec2(float(texel & 3u), float(texel >> 2u)) * 0.5 - 1.0;
}

// The unit direction of a texel's middle.
vec3 texel_middle(uint texel) {
    return normalize(octahedron_point(texel_corner(texel) + 0.25));
}

// A texel beyond the map's border is a texel of the same border: the edge is folded at its middle.
uvec2 folded(ivec2 texel) {
    bool beside = texel.x < 0 || texel.x > 3;
    bool above = texel.y < 0 || texel.y > 3;
    ivec2 inside = clamp(texel, ivec2(0), ivec2(3));
    return uvec2(above ? 3 - inside.x : inside.x, beside ? 3 - inside.y : inside.y);
}

// Weight and clamped cosine of a quarter of a texel: the solid angle is proportional to the area over the cubed
// distance.
vec2 quarter(vec2 at, vec3 n) {
    vec3 p = octahedron_point(at);
    float inverse = inversesqrt(dot(p, p));
    return inverse * inverse * inverse * vec2(1.0, max(dot(n, p) * inverse, 0.0));
}

// The mean of the clamped cosine to a unit normal over a texel's solid angle, from the middles of its quarters: error
// at most 0.031.
float texel_cosine(uint texel, vec3 n) {
    vec2 corner = texel_corner(texel);
    vec2 sum = quarter(corner + vec2(0.125, 0.125), n) + quarter(corner + vec2(0.375, 0.125), n)
        + quarter(corner + vec2(0.125, 0.375), n) + quarter(corner + vec2(0.375, 0.375), n);
    return sum.y / sum.x;
}

// Solid angles in sr of the eight texels about ±z and of the eight about the equator.
const float POLE_TEXEL = 0.892119;
const float EQUATOR_TEXEL = 0.678677;
// These solid angles over the sum of the weights of a texel's four quarters.
const float POLE_SHARE = POLE_TEXEL / 14.87144;
const float EQUATOR_SHARE = EQUATOR_TEXEL / 10.26259;

float texel_solid_angle(uint texel) {
    bvec2 inner = bvec2((texel + 1u & 2u) != 0u, ((texel >> 2u) + 1u & 2u) != 0u);
    return inner.x == inner.y ? POLE_TEXEL : EQUATOR_TEXEL;
}

// The light of p and its mirror images in the planes of two axes towards ±n, over |p|⁴: |p|³ is from the solid angle,
// and |p| from the cosine.
float mirrored(vec3 n, vec3 p) {
    vec3 q = n * p;
    vec4 sum = abs(vec4(q.x + q.y + q.z, q.x - q.y + q.z, q.x + q.y - q.z, q.x - q.y - q.z));
    float squared = dot(p, p);
    return (sum.x + sum.y + sum.z + sum.w) / (squared * squared);
}

// Σ solid angle · texel_cosine over all texels, which would be π if the means were exact; they are off by at most 2.2
// %. The middles of quarters are mirror images of ten points, so that no loop is needed.
float texels_total(vec3 n) {
    float e = 0.125;
    float pole = mirrored(n, e * vec3(1, 1, 6)) + mirrored(n, e * vec3(1, 3, 4)) + mirrored(n, e * vec3(3, 1, 4))
        + mirrored(n, e * vec3(3, 3, 2));
    float equator = mirrored(n, e * vec3(1, 5, 2)) + mirrored(n, e * vec3(5, 1, 2))
        + 0.5
            * (mirrored(n, e * vec3(1, 7, 0)) + mirrored(n, e * vec3(7, 1, 0)) + mirrored(n, e * vec3(3, 5, 0))
                + mirrored(n, e * vec3(5, 3, 0)));
    return POLE_SHARE * pole + EQUATOR_SHARE * equator;
}
