// Points on the plane of an item, by their position in its voxel.

#include "common/closest_point.glsl"
#include "common/dominant_axis.glsl"

// The point on the plane through `a` with normal `n` (any length except 0) at the offset `at` from `center` along the
// two axes after the dominant one.
vec3 on_plane(vec3 a, vec3 n, vec3 center, vec2 at) {
    int axis = int(dominant_axis(n));
    vec3 p = center;
    p[(axis + 1) % 3] += at.x;
    p[(axis + 2) % 3] += at.y;
    p[axis] += dot(n, a - p) / n[axis];
    return p;
}

// Whether such a point lies in the triangle's part inside the voxel.
bool in_part(vec3 a, vec3 b, vec3 c, vec3 n, vec3 center, vec3 p) {
    int axis = int(dominant_axis(n));
    vec2 bc = barycentric(a, b, c, p);
    return abs(p[axis] - center[axis]) <= 0.5 && min(bc.x, bc.y) >= 0.0 && bc.x + bc.y <= 1.0;
}

// The point at which a split item is lit; `anchor` is as in ItemPart.
vec3 anchor_point(vec3 a, vec3 n, vec3 center, uint anchor) {
    return on_plane(a, n, center, unpackUnorm2x16(anchor) - 0.5);
}
