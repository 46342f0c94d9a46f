// Grids of probes: the probe of each cell, and the layout of its texels. CPU twin: tests/twins/probes.rs.

#include "gi/probes/constants.glsl"
#include "common/octahedron.glsl"

// A cube of PROBE_EDGE³ cells with one probe each. Lengths are in voxels of the base grid.
struct ProbeGrid {
    vec3 corner; // least corner, voxels
    float spacing; // edge of a cell, voxels
    ivec3 first; // its first cell, counted from the base grid's corner
};

const uint PROBE_ACTIVE = 1u; // it sends rays, and look-ups read it
const uint PROBE_FRESH = 2u; // it has no light yet

struct Probe {
    vec3 position; // voxels of the base grid
    uint state; // bits PROBE_ACTIVE and PROBE_FRESH
    ivec3 cell; // counted from the base grid's corner
};

bool is_active(Probe probe) {
    return (probe.state & PROBE_ACTIVE) != 0u;
}

// The result of one ray of a probe.
struct ProbeRay {
    vec3 light; // stored radiance, including the sky's
    float open; // transmittance to the sky, 0 to 1
    float distance; // voxels; negative: the back of a one-sided surface
};

// Index of the probe of a cell. Cells that stay in a moving grid keep their probes.
uint probe_of(uint grid, ivec3 cell) {
    uvec3 slot = uvec3(cell) & (PROBE_EDGE - 1u);
    return grid * PROBES_PER_GRID + (slot.z * PROBE_EDGE + slot.y) * PROBE_EDGE + slot.x;
}

// The cell of a probe, in a grid whose first cell is `first`.
ivec3 cell_of(uint probe, ivec3 first) {
    uvec3 slot = uvec3(probe, probe / PROBE_EDGE, probe / (PROBE_EDGE * PROBE_EDGE)) & (PROBE_EDGE - 1u);
    return first + ivec3((slot - uvec3(first)) & (PROBE_EDGE - 1u));
}

// Texels along each side of an octahedral map, and texels of the whole map with its border. The border, one texel wide,
// repeats the texels beyond the edges.
const uint LIGHT_SIDE = 8u;
const uint LIGHT_TEXELS = (LIGHT_SIDE + 2u) * (LIGHT_SIDE + 2u);
const uint DISTANCE_SIDE = 16u;
const uint DISTANCE_TEXELS = (DISTANCE_SIDE + 2u) * (DISTANCE_SIDE + 2u);

// Unit direction of the middle of a texel. Texels are counted without the border.
vec3 texel_way(uvec2 texel, uint side) {
    return normalize(octahedron_point((vec2(texel) + 0.5) * (2.0 / float(side)) - 1.0));
}

// Index of a texel in its map. The coordinates −1 and `side` are the border.
uint texel_place(ivec2 texel, uint side) {
    return uint(texel.y + 1) * (side + 2u) + uint(texel.x + 1);
}

// The texels of the border that repeat a texel of the map. The result has a bit for each of the three that exists. An
// edge of the map continues at the same edge, mirrored about its middle.
uint border_of(uvec2 texel, uint side, out ivec2 border[3]) {
    ivec2 t = ivec2(texel);
    int last = int(side) - 1;
    bvec2 at_edge = bvec2(t.x == 0 || t.x == last, t.y == 0 || t.y == last);
    ivec2 beyond = ivec2(t.x == 0 ? -1 : last + 1, t.y == 0 ? -1 : last + 1);
    border[0] = ivec2(beyond.x, last - t.y);
    border[1] = ivec2(last - t.x, beyond.y);
    border[2] = ivec2(last) - beyond;
    return (at_edge.x ? 1u : 0u) | (at_edge.y ? 2u : 0u) | (all(at_edge) ? 4u : 0u);
}

// The four texels about a direction, for bilinear filtering.
struct Texels {
    uint first; // index of the texel with the least coordinates
    vec2 part; // weight of the next texels along each axis
};

Texels texels_about(vec3 d, uint side) {
    vec2 at = (octahedron_at(d) * 0.5 + 0.5) * float(side) + 0.5;
    vec2 least = clamp(floor(at), vec2(0.0), vec2(side));
    return Texels(uint(least.y) * (side + 2u) + uint(least.x), at - least);
}
