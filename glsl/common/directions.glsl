// Directions about a normal: a frame, and cosine-distributed sets of any size. CPU twin: tests/twins/directions.rs.

#include "common/numbers.glsl"

// Columns: tangent, bitangent, normal. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017, without the
// discontinuity at n.z = 0: the only singular direction is −z.
mat3 tangent_frame(vec3 n) {
    float a = -1.0 / (1.0 + max(n.z, -0.9999999));
    float b = n.x * n.y * a;
    return n.z < -0.9999999 ? mat3(vec3(0.0, -1.0, 0.0), vec3(-1.0, 0.0, 0.0), n)
                            : mat3(vec3(1.0 + n.x * n.x * a, b, -n.x), vec3(b, 1.0 + n.y * n.y * a, -n.y), n);
}

// Direction i of `count` about +z, cosine-distributed: a sunflower pattern on the unit disc, projected to the
// hemisphere. `shift` is the position of the direction within its share of the set; (0.5, 0) is the middle.
vec3 cosine_direction(uint i, uint count, vec2 shift) {
    float u = (float(i) + shift.x) / float(count);
    float turn = GOLDEN_ANGLE * float(i) + 2.0 * PI * shift.y;
    return vec3(sqrt(u) * cos(turn), sqrt(u) * sin(turn), sqrt(1.0 - u));
}

// Tangent of the half angle of the cone that one direction of such a set represents.
float cosine_aperture(uint count) {
    float spread = count < 64u ? 0.6 : 0.5;
    return spread / sqrt(float(count));
}

// The hemisphere of a shading normal extends below the facet. Directions below the facet are mirrored to its upper
// side.
vec3 above_facet(vec3 d, vec3 facet) {
    return d - 2.0 * min(dot(d, facet), 0.0) * facet;
}

// The shading normal, bent until it faces the incoming ray.
vec3 normal_against(vec3 normal, vec3 d) {
    return normalize(normal - d * max(dot(normal, d) + 1e-3, 0.0));
}

// A cosine-distributed direction about +z. `u` are two numbers in [0, 1).
vec3 cosine_sample(vec2 u) {
    float r = sqrt(u.y);
    float turn = 2.0 * PI * u.x;
    return vec3(r * cos(turn), r * sin(turn), sqrt(max(1.0 - u.y, 0.0)));
}
