// Classes of triangle orientations: cells on the faces of a cube, a third of an edge in each direction. Normals in a
// cell differ by at most 51°, and by 16° on average. CPU twin: tests/twins/item_groups.rs.

#include "common/dominant_axis.glsl"

const uint CELLS_PER_EDGE = 3u;
const uint FACING_CELLS = 6u * CELLS_PER_EDGE * CELLS_PER_EDGE;

// `n` has any length except 0.
uint facing_cell(vec3 n) {
    uint axis = dominant_axis(n);
    vec2 slope = across(n, axis) / abs(n[axis]);
    uvec2 place = min(uvec2((0.5 * slope + 0.5) * float(CELLS_PER_EDGE)), CELLS_PER_EDGE - 1u);
    return ((n[axis] < 0.0 ? 3u + axis : axis) * CELLS_PER_EDGE + place.y) * CELLS_PER_EDGE + place.x;
}
