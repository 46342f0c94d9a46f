// The talk's sets of diffuse cones about +z (listings of BeRo and urs, CC0), cosine-distributed ones of any size, and
// their rotation to a normal.

#include "common/directions.glsl"
#include "gi/cones/constants.glsl"

struct Cone {
    vec3 direction;
    float weight; // weights of a set sum to 1: the sum over cones is E/π
    float aperture; // tangent of the half angle
};

const vec3 SIDES_6A[5] = vec3[5](vec3(-0.794654, 0.607062, 0.000000), vec3(0.642889, 0.607062, 0.467086),
    vec3(0.642889, 0.607062, -0.467086), vec3(-0.245562, 0.607062, 0.755761), vec3(-0.245562, 0.607062, -0.755761));

const vec3 SIDES_6B[5] = vec3[5](vec3(0.0, 0.866025, 0.5), vec3(0.823639, 0.267617, 0.5),
    vec3(0.509037, -0.700629, 0.5), vec3(-0.509037, -0.700629, 0.5), vec3(-0.823639, 0.267617, 0.5));

const vec3 SET_16[16] = vec3[16](vec3(0.898904, 0.435512, 0.0479745), vec3(0.898904, -0.0479745, 0.435512),
    vec3(-0.898904, -0.435512, 0.0479745), vec3(-0.898904, 0.0479745, 0.435512), vec3(0.0479745, 0.898904, 0.435512),
    vec3(-0.435512, 0.898904, 0.0479745), vec3(-0.0479745, -0.898904, 0.435512), vec3(0.435512, -0.898904, 0.0479745),
    vec3(0.435512, 0.0479745, 0.898904), vec3(-0.435512, -0.0479745, 0.898904), vec3(0.0479745, -0.435512, 0.898904),
    vec3(-0.0479745, 0.435512, 0.898904), vec3(0.57735, 0.57735, 0.57735), vec3(0.57735, -0.57735, 0.57735),
    vec3(-0.57735, 0.57735, 0.57735), vec3(-0.57735, -0.57735, 0.57735));
const float SUM_OF_COSINES_16 = 4.0 * (0.0479745 + 0.435512 + 0.898904 + 0.57735);

// `shift` is the position of a direction within its share of the set; (0.5, 0) is the middle. The talk's sets only
// rotate.
Cone cone_set(uint i, vec2 shift) {
    if (CONE_SET == 0u) {
        return Cone(vec3(0.0, 0.0, 1.0), 1.0, 2.0);
    }
    if (CONE_SET == 1u) {
        float x = 0.707106781;
        if (i == 0u) {
            return Cone(vec3(0.0, 0.0, 1.0), 0.28, 1.0);
        }
        float s = (i & 1u) != 0u ? x : -x;
        return Cone(i < 3u ? vec3(0.0, s, x) : vec3(s, 0.0, x), 0.18, 1.0);
    }
    if (CONE_SET == 2u) {
        float total = 1.0 + 5.0 * 0.607;
        if (i == 0u) {
            return Cone(vec3(0.0, 0.0, 1.0), 1.0 / total, 0.5);
        }
        // D6: the side cones are given about y; as printed, two of them point below the surface.
        vec3 side = normalize(SIDES_6A[i - 1u]);
        return Cone(printed(6) ? side : side.xzy, 0.607 / total, 0.549092);
    }
    if (CONE_SET == 3u) {
        return i == 0u ? Cone(vec3(0.0, 0.0, 1.0), 0.25, 0.57735026919) : Cone(SIDES_6B[i - 1u], 0.15, 0.57735026919);
    }
    if (CONE_SET == COSINE_SETS) {
        return Cone(cosine_direction(i, CONE_COUNT, shift), 1.0 / float(CONE_COUNT), cosine_aperture(CONE_COUNT));
    }
    vec3 d = normalize(SET_16[i]);
    // D26: sixteen evenly spread directions need the cosine in their weights.
    return Cone(d, printed(26) ? 1.0 / 16.0 : d.z / SUM_OF_COSINES_16, 0.3141595);
}

// D22: the printed frame is discontinuous at |n.y| = |n.z|.
mat3 talk_frame(vec3 n) {
    if (!printed(22)) {
        return tangent_frame(n);
    }
    vec3 t0 = cross(vec3(0.0, 1.0, 0.0), n);
    vec3 t1 = cross(vec3(0.0, 0.0, 1.0), n);
    vec3 tangent = normalize(length(t0) < length(t1) ? t1 : t0);
    vec3 bitangent = normalize(cross(tangent, n));
    tangent = normalize(cross(bitangent, n));
    return mat3(tangent, bitangent, n);
}

// Rotates by `turn` about a unit axis (Rodrigues). D7: printed as the transpose. D8: printed with `turn` as radians.
mat3 jitter_rotation(vec3 axis, float turn) {
    float angle = printed(8) ? turn : 2.0 * PI * turn;
    float s = sin(angle);
    float c = cos(angle);
    vec3 k = axis * s;
    mat3 cross_matrix = mat3(0.0, k.z, -k.y, -k.z, 0.0, k.x, k.y, -k.x, 0.0);
    mat3 rotation = outerProduct(axis, axis) * (1.0 - c) + mat3(c) + cross_matrix;
    return printed(7) ? transpose(rotation) : rotation;
}
