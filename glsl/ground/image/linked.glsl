// Whether something stands between two places of one surface, so that the light of one is not the other's: a thin wall
// that is seen on edge, a board on a floor.

#include "ground/ray.glsl"

// Of the distance between two places, how far off their surface the ray between them runs. The surface may bend as much
// as a circle whose radius is 1.25 times that distance; what stands less high than the ray goes unseen.
const float LINK_LIFT = 0.1;
// Of the light, what must come through all that stands between: a pane that dims it parts two places as a wall does.
const float LINK_CLEAR = 0.9;

// Unit normals n and m. The places must not be the same.
bool linked(vec3 p, vec3 n, vec3 q, vec3 m) {
    float lift = LINK_LIFT * length(q - p);
    vec3 from = p + lift * n;
    vec3 way = q + lift * m - from;
    float distance = length(way);
    return all(greaterThan(trace_shadow_ray(from, way / max(distance, 1e-9), distance), vec3(LINK_CLEAR)));
}
