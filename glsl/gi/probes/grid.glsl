// Grids of probes: which probe stands for a cell, and where its texels are. CPU twin: tests/twins/probes.rs.

#include "gi/probes/constants.glsl"
#include "common/octahedron.glsl"

// A cube of PROBE_EDGE³ cells, a probe each, among the voxels of the base grid.
struct ProbeGrid {
    vec3 corner; // voxels
    float spacing; // of its probes, voxels
    ivec3 first; // its first cell, counted from the base grid's corner
};

const uint PROBE_ACTIVE = 1u; // it sends rays, and look-ups read it
const uint PROBE_FRESH = 2u; // it has no light yet

struct Probe {
    vec3 position; // voxels of the base grid
    uint state;
    ivec3 cell; // counted from the base grid's corner
};

bool is_active(Probe probe) {
    return (probe.state & PROBE_ACTIVE) != 0u;
}

// What one ray of a probe found.
struct ProbeRay {
    vec3 light; // stored radiance, the sky's included
    float open; // share of it that comes from beyond the scene
    float distance; // voxels; negative where it met the back of a one-sided surface
};

// The probe of a cell: a grid that moves keeps the probes of the cells that stay in it.
uint probe_of(uint grid, ivec3 cell) {
    uvec3 slot = uvec3(cell) & (PROBE_EDGE - 1u);
    return grid * PROBES_PER_GRID + (slot.z * PROBE_EDGE + slot.y) * PROBE_EDGE + slot.x;
}

// The cell of a probe, in a grid whose first cell is `first`.
ivec3 cell_of(uint probe, ivec3 first) {
    uvec3 slot = uvec3(probe, probe / PROBE_EDGE, probe / (PROBE_EDGE * PROBE_EDGE)) & (PROBE_EDGE - 1u);
    return first + ivec3((slot - uvec3(first)) & (PROBE_EDGE - 1u));
}

// Texels of an octahedral map, along each side and with a border of one: what lies beyond an edge of the map.
const uint LIGHT_SIDE = 8u;
const uint LIGHT_TEXELS = (LIGHT_SIDE + 2u) * (LIGHT_SIDE + 2u);
const uint DISTANCE_SIDE = 16u;
const uint DISTANCE_TEXELS = (DISTANCE_SIDE + 2u) * (DISTANCE_SIDE + 2u);

// Of the middle of a texel, counted without the border.
vec3 texel_way(uvec2 texel, uint side) {
    return normalize(octahedron_point((vec2(texel) + 0.5) * (2.0 / float(side)) - 1.0));
}

// Place of a texel among those of its map; −1 and `side` are the border.
uint texel_place(ivec2 texel, uint side) {
    return uint(texel.y + 1) * (side + 2u) + uint(texel.x + 1);
}

// The texels of the border that show texel (x, y) of the map once more: up to three, and which of them there are. An
// edge of the map is folded in its middle.
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

// The four texels about a direction.
struct Texels {
    uint first; // the place of the least one
    vec2 part; // the weight of those behind it along each axis
};

Texels texels_about(vec3 d, uint side) {
    vec2 at = (octahedron_at(d) * 0.5 + 0.5) * float(side) + 0.5;
    vec2 least = clamp(floor(at), vec2(0.0), vec2(side));
    return Texels(uint(least.y) * (side + 2u) + uint(least.x), at - least);
}
