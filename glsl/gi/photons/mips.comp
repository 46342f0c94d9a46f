#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with OPACITY
// Mips of the parents of occupied cells: of the map, a thread per cell and direction; with OPACITY of the opacity, a
// thread per cell. Checked by tests/device/passes_photons.rs.
//
// The notes' Σ photons · v²/D², with the edge of a level as D, is a quarter of the sum over eight children. A plane, of
// which four children hold a part, keeps its opacity and its light. The printed form is this sum. The corrected form
// weights photons behind others of the same cell by the light that these let through, and limits opacity to 1, with its
// light.

#include "common/count.glsl"
#include "gi/photons/constants.glsl"
#include "gi/photons/octahedron.glsl"
#include "gi/photons/store.glsl"
#include "ground/cells.glsl"

// The level below.
uniform sampler3D map_below;
uniform sampler3D forth_below;
uniform sampler3D back_below;

layout(push_constant) uniform Push {
    uint level;
    uint first; // of the level's list among the cells
} push;

vec4 children_sum(sampler3D below, ivec3 corner) {
    COUNT(VOLUME_TEXELS, 8u);
    return texelFetch(below, corner, 0) + texelFetch(below, corner + ivec3(1, 0, 0), 0)
        + texelFetch(below, corner + ivec3(0, 1, 0), 0) + texelFetch(below, corner + ivec3(1, 1, 0), 0)
        + texelFetch(below, corner + ivec3(0, 0, 1), 0) + texelFetch(below, corner + ivec3(1, 0, 1), 0)
        + texelFetch(below, corner + ivec3(0, 1, 1), 0) + texelFetch(below, corner + ivec3(1, 1, 1), 0);
}

#ifdef OPACITY
const uint THREADS = 1u;

// There are four columns of two children along every axis; a child that fills its column fills it once.
vec3 columns(sampler3D below, ivec3 corner) {
    COUNT(VOLUME_TEXELS, 8u);
    vec3 a = texelFetch(below, corner, 0).rgb;
    vec3 b = texelFetch(below, corner + ivec3(1, 0, 0), 0).rgb;
    vec3 c = texelFetch(below, corner + ivec3(0, 1, 0), 0).rgb;
    vec3 d = texelFetch(below, corner + ivec3(1, 1, 0), 0).rgb;
    vec3 e = texelFetch(below, corner + ivec3(0, 0, 1), 0).rgb;
    vec3 f = texelFetch(below, corner + ivec3(1, 0, 1), 0).rgb;
    vec3 g = texelFetch(below, corner + ivec3(0, 1, 1), 0).rgb;
    vec3 h = texelFetch(below, corner + ivec3(1, 1, 1), 0).rgb;
    vec4 x = min(vec4(a.x + b.x, c.x + d.x, e.x + f.x, g.x + h.x), vec4(1.0));
    vec4 y = min(vec4(a.y + c.y, b.y + d.y, e.y + g.y, f.y + h.y), vec4(1.0));
    vec4 z = min(vec4(a.z + e.z, b.z + f.z, c.z + g.z, d.z + h.z), vec4(1.0));
    return 0.25 * vec3(dot(x, vec4(1.0)), dot(y, vec4(1.0)), dot(z, vec4(1.0)));
}

void filter_cell(uvec3 cell, uint texel, uint edge) {
    ivec3 corner = 2 * ivec3(cell);
    vec4 forth = children_sum(forth_below, corner);
    if (printed(ROW_MIPS)) {
        imageStore(opacity_forth, ivec3(cell), 0.25 * forth);
        imageStore(opacity_back, ivec3(cell), 0.25 * children_sum(back_below, corner));
    } else {
        imageStore(opacity_forth, ivec3(cell), vec4(columns(forth_below, corner), min(0.25 * forth.a, 1.0)));
        imageStore(opacity_back, ivec3(cell), vec4(columns(back_below, corner), 0.0));
    }
}
#else
const uint THREADS = TEXELS;

struct Child {
    vec4 sent;
    vec3 hides; // opacity for light that travels along −x or +x, and so on
};

Child child_at(ivec3 cell, uint texel, int edge, vec3 d) {
    COUNT(VOLUME_TEXELS, 3u);
    vec3 forth = texelFetch(forth_below, cell, 0).rgb;
    vec3 back = texelFetch(back_below, cell, 0).rgb;
    vec4 sent = texelFetch(map_below, map_place(uvec3(cell), texel, uint(edge)), 0);
    return Child(sent, min(mix(forth, back, greaterThan(d, vec3(0.0))), vec3(1.0)));
}

// Two children in a row along one axis, as seen from the side of `first`.
vec4 in_row(Child first, Child second, uint axis) {
    return first.sent + (1.0 - first.hides[axis]) * second.sent;
}

// Photons behind others of the same cell are hidden: the rows along each axis are weighted by the axis's share of the
// texel's direction.
vec4 seen_children(ivec3 corner, uint texel, int edge) {
    vec3 d = texel_middle(texel);
    ivec3 first = ivec3(greaterThan(d, vec3(0.0))); // the child that light travelling against d meets first
    ivec3 second = 1 - first;
    Child a = child_at(corner + first, texel, edge, d);
    Child b = child_at(corner + ivec3(second.x, first.yz), texel, edge, d);
    Child c = child_at(corner + ivec3(first.x, second.y, first.z), texel, edge, d);
    Child e = child_at(corner + ivec3(second.xy, first.z), texel, edge, d);
    Child f = child_at(corner + ivec3(first.xy, second.z), texel, edge, d);
    Child g = child_at(corner + ivec3(second.x, first.y, second.z), texel, edge, d);
    Child h = child_at(corner + ivec3(first.x, second.yz), texel, edge, d);
    Child i = child_at(corner + second, texel, edge, d);
    vec4 x = in_row(a, b, 0u) + in_row(c, e, 0u) + in_row(f, g, 0u) + in_row(h, i, 0u);
    vec4 y = in_row(a, c, 1u) + in_row(b, e, 1u) + in_row(f, h, 1u) + in_row(g, i, 1u);
    vec4 z = in_row(a, f, 2u) + in_row(b, g, 2u) + in_row(c, h, 2u) + in_row(e, i, 2u);
    vec3 share = d * d;
    return 0.25 * (x * share.x + y * share.y + z * share.z);
}

void filter_cell(uvec3 cell, uint texel, uint edge) {
    if (printed(ROW_MIPS)) {
        vec4 sum = 0.25 * children_sum(map_below, map_place(2u * cell, texel, 2u * edge));
        imageStore(photon_map, map_place(cell, texel, edge), min(sum, vec4(LARGEST_STORED)));
    } else {
        vec4 sum = seen_children(2 * ivec3(cell), texel, 2 * int(edge));
        imageStore(photon_map, map_place(cell, texel, edge), sum / max(sum.a, 1.0));
    }
}
#endif

void main() {
    uint edge = EDGE >> push.level;
    uint count = cell_counts[push.level].count * THREADS;
    for (uint i = gl_GlobalInvocationID.x; i < count; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        filter_cell(cell_at(cells[push.first + i / THREADS], edge), i % THREADS, edge);
    }
}
