// The voxels of a column that list a triangle.
//! with DILATED

#include "common/dominant_axis.glsl"
#include "common/triangle_box.glsl"
#include "ground/constants.glsl"
#include "ground/list_append.glsl"

// In voxels of the grid.
struct Projected {
    vec3 a;
    vec3 b;
    vec3 c;
#ifdef DILATED
    vec3 d; // of a strip
#endif
    vec3 normal; // from triangle_normal
    uint axis; // the axis that the triangle faces most, along which columns run
};

// The maximum number of voxels in a column that a triangle may touch: its slope against the column is at most 1.
const uint MOST_IN_COLUMN = 4u;

uvec3 voxel_at(Projected p, uvec2 column, uint depth) {
    uvec3 voxel;
    voxel[(p.axis + 1u) % 3u] = column.x;
    voxel[(p.axis + 2u) % 3u] = column.y;
    voxel[p.axis] = depth;
    return voxel;
}

// The first and last voxel of a column that may be touched. `column` is along the two axes after the projected one.
uvec2 depths_in(Projected p, uvec2 column) {
    uint axis = p.axis;
    vec2 middle = vec2(column) + 0.5;

    // The crossing of the plane with the column, within the triangle's own depth. The dominant axis keeps the slope
    // below 1.
    float depth_low = min(min(p.a[axis], p.b[axis]), p.c[axis]);
    float depth_high = max(max(p.a[axis], p.b[axis]), p.c[axis]);
#ifdef DILATED
    depth_low = min(depth_low, p.d[axis]);
    depth_high = max(depth_high, p.d[axis]);
#endif
    vec2 slope = across(p.normal, axis) / p.normal[axis];
    float depth = p.a[axis] - dot(slope, middle - across(p.a, axis));
    // The bounds include a hundredth of a voxel for rounding; the exact test follows.
    float spread = 0.5 * (abs(slope.x) + abs(slope.y)) + 0.01;
    float last = float(EDGE) - 1.0;
    float first = clamp(floor(max(depth_low, depth - spread) - 0.001), 0.0, last);
    float end = clamp(floor(min(depth_high, depth + spread) + 0.001), 0.0, last);
    return uvec2(first, end);
}

// The voxels of a column that list the triangle, a bit each, from the first one of depths_in.
uint touched_in(Projected p, uvec2 column) {
    uvec2 depths = depths_in(p, column);
    uint touched = 0u;
    for (uint k = 0u; k < MOST_IN_COLUMN && depths.x + k <= depths.y; k++) {
        uvec3 voxel = voxel_at(p, column, depths.x + k);
        bool touches = triangle_touches_voxel(p.a, p.b, p.c, p.normal, vec3(voxel) + 0.5);
#ifdef DILATED
        touches = touches || triangle_touches_voxel(p.b, p.c, p.d, p.normal, vec3(voxel) + 0.5);
#endif
        touched |= touches && !in_hole(voxel) ? 1u << k : 0u;
    }
    return touched;
}

// Lists the triangle in the voxels `touched` of a column, with the items from `item`.
void list_column(uint triangle, Projected p, uvec2 column, uint touched, uint item) {
    uint first = depths_in(p, column).x;
    for (uint left = touched; left != 0u; left &= left - 1u) {
        put(item++, triangle, voxel_at(p, column, first + uint(findLSB(left))));
    }
}
