// Lists a triangle in the voxels that it touches of a column of them.
//! with DILATED

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
    uint axis; // that the triangle faces most, along which columns go
};

// `pixel`: along the two axes after the projected one.
void list_column(uint triangle, Projected p, uvec2 pixel) {
    uint axis = p.axis;
    uint u = (axis + 1u) % 3u;
    uint v = (axis + 2u) % 3u;
    vec2 middle = vec2(pixel) + 0.5;

    // Where the plane crosses the column, within the triangle's own depth. The dominant axis keeps the slope below 1.
    float depth_low = min(min(p.a[axis], p.b[axis]), p.c[axis]);
    float depth_high = max(max(p.a[axis], p.b[axis]), p.c[axis]);
#ifdef DILATED
    depth_low = min(depth_low, p.d[axis]);
    depth_high = max(depth_high, p.d[axis]);
#endif
    vec2 slope = vec2(p.normal[u], p.normal[v]) / p.normal[axis];
    float depth = p.a[axis] - dot(slope, middle - vec2(p.a[u], p.a[v]));
    // A hundredth of a voxel for rounding: the exact test follows.
    float spread = 0.5 * (abs(slope.x) + abs(slope.y)) + 0.01;
    float last = float(EDGE) - 1.0;
    int first = int(clamp(floor(max(depth_low, depth - spread) - 0.001), 0.0, last));
    int end = int(clamp(floor(min(depth_high, depth + spread) + 0.001), 0.0, last));
    for (int k = first; k <= end; k++) {
        uvec3 voxel;
        voxel[u] = pixel.x;
        voxel[v] = pixel.y;
        voxel[axis] = uint(k);
        bool touches = triangle_touches_voxel(p.a, p.b, p.c, p.normal, vec3(voxel) + 0.5);
#ifdef DILATED
        touches = touches || triangle_touches_voxel(p.b, p.c, p.d, p.normal, vec3(voxel) + 0.5);
#endif
        if (touches && !in_hole(voxel)) {
            append(triangle, voxel);
        }
    }
}
