// Weights by which neighbouring places share gathered light. The includer declares `frame`.

#include "common/lobe.glsl"
#include "ground/boxes.glsl"

// In voxels of a box of edge 64, for every size of box: finer voxels must not share less.
const float SHARED_PLANE = 0.5; // allowed distance of a place from the other's plane
const float SHARED_REACH = 8.0; // distance at which a place counts half

// A weight from 1 for the same place to 0 for another surface. n and m are unit normals.
float likeness(vec3 p, vec3 n, vec3 q, vec3 m) {
    vec3 apart = (q - p) * (box_at(p).scale * (64.0 / float(EDGE)));
    float off_plane = max(abs(dot(apart, n)), abs(dot(apart, m)));
    float facing = max(dot(n, m), 0.0);
    facing *= facing;
    facing *= facing;
    float near = 1.0 / (1.0 + dot(apart, apart) / (SHARED_REACH * SHARED_REACH));
    return facing * facing * near * max(1.0 - off_plane / SHARED_PLANE, 0.0);
}

// The likeness of the specular reflection of lamps at two places, in lobes of that α. GGX's lobe falls off with the
// angle between its middle and the half vector, which changes half as fast as the mirror direction. Points on lamps
// find no light in mirrors.
float mirrored_alike(vec3 p, vec3 n, vec3 q, vec3 m, float alpha) {
    vec3 to_p = frame.orthographic != 0u ? frame.forward : normalize(p - frame.eye);
    vec3 to_q = frame.orthographic != 0u ? frame.forward : normalize(q - frame.eye);
    vec3 apart = reflect(to_p, n) - reflect(to_q, m);
    return alpha < MIN_ALPHA ? 1.0 : exp(-0.25 * dot(apart, apart) / (alpha * alpha));
}

// A unit vector in 22 bits, exact as a float: an octahedral map (Cigolle et al., "A Survey of Efficient Representations
// for Independent Unit Vectors", JCGT 2014). Two bits remain for links.
float pack_normal(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(p, vec2(0.0)));
    p = n.z < 0.0 ? folded : p;
    vec2 bits = floor(clamp(p * 0.5 + 0.5, 0.0, 1.0) * 2047.0 + 0.5);
    return bits.x + 2048.0 * bits.y;
}

vec3 unpack_normal(float packed) {
    vec2 bits = mod(vec2(packed, floor(packed / 2048.0)), 2048.0);
    vec2 p = bits / 2047.0 * 2.0 - 1.0;
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    vec2 folded = (1.0 - abs(p.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(p, vec2(0.0)));
    n.xy = n.z < 0.0 ? folded : n.xy;
    return normalize(n);
}

// Links of a gathered pixel: there is no obstacle between it and its right neighbour, or its lower neighbour.
const uint LINK_RIGHT = 1u;
const uint LINK_DOWN = 2u;

// Adds links to a packed normal.
float pack_links(float packed, uint links) {
    return packed + 4194304.0 * float(links);
}

// The links next to a packed normal; none without gathering.
uint unpack_links(float packed) {
    return uint(max(packed, 0.0) / 4194304.0);
}
