// Whether an obstacle lies between two places of one surface, so that they do not share light: a thin wall seen on
// edge, or a board on a floor.

#include "ground/ray.glsl"

// The height of the ray between two places over their surface, as a share of their distance. The surface may bend like
// a circle whose radius is 1.25 times that distance; obstacles below the ray are missed.
const float LINK_LIFT = 0.1;
// The share of light that must pass all obstacles: a pane that dims it separates two places like a wall.
const float LINK_CLEAR = 0.9;

// n and m are unit normals. The places must differ.
bool linked(vec3 p, vec3 n, vec3 q, vec3 m) {
    float lift = LINK_LIFT * length(q - p);
    vec3 from = p + lift * n;
    vec3 way = q + lift * m - from;
    float distance = length(way);
    return all(greaterThan(trace_shadow_ray(from, way / max(distance, 1e-9), distance), vec3(LINK_CLEAR)));
}
