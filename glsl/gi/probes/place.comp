#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Places the probes of one grid, one thread per probe. Step 0 puts them at the middles of the cells with list items
// about them. Step 1 moves them by the distances of a few rays. Step 2 switches off those within solids. The result
// depends on the surfaces of this frame alone.
#include "common/count.glsl"
#include "gi/probes/feelers.glsl"
#include "gi/probes/push.glsl"

layout(local_size_x = 64) in;

layout(scalar) buffer ProbeList { Probe probes[]; };
layout(scalar) readonly buffer ProbeGrids { ProbeGrid probe_grids[]; };
layout(scalar) readonly buffer ProbeWays { vec3 probe_ways[]; };
layout(scalar) readonly buffer FeltDistances { float felt_distances[]; };
layout(scalar) readonly buffer GridHeads { uint grid_heads[]; };

// Whether a look-up may read the probe: one of the 27 cells about it has list items. `local`: the cell in the grid.
bool is_asked(ivec3 local) {
    bool any = false;
    for (int k = 0; k < 27; k++) {
        ivec3 cell = local + ivec3(k % 3, k / 3 % 3, k / 9) - 1;
        // Points beyond the grid's border read the outermost probes.
        cell = clamp(cell, ivec3(0), ivec3(int(PROBE_EDGE) - 1));
        any = any || grid_heads[(uint(cell.z) * PROBE_EDGE + uint(cell.y)) * PROBE_EDGE + uint(cell.x)] != 0u;
    }
    COUNT(HEADS, 27u);
    return any;
}

Felt feel(uint index) {
    Felt felt = Felt(0u, 1e30, vec3(0.0), 1e30, vec3(0.0), 1e30);
    for (uint i = 0u; i < FEELERS; i++) {
        float met = felt_distances[index * FEELERS + i];
        vec3 way = probe_ways[PROBE_RAYS + i];
        bool back = met < 0.0;
        felt.backs += back ? 1u : 0u;
        bool nearer = back && -met < felt.nearest_back;
        felt.nearest_back = nearer ? -met : felt.nearest_back;
        felt.to_back = nearer ? way : felt.to_back;
        nearer = !back && met < felt.nearest_front;
        felt.nearest_front = nearer ? met : felt.nearest_front;
        felt.to_front = nearer ? way : felt.to_front;
    }
    float opposite = -0.8;
    for (uint i = 0u; i < FEELERS; i++) {
        vec3 way = probe_ways[PROBE_RAYS + i];
        felt.behind = dot(way, felt.to_front) < opposite ? min(felt.behind, abs(felt_distances[index * FEELERS + i]))
                                                         : felt.behind;
    }
    COUNT(WORDS, 8u * FEELERS);
    return felt;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    if (local >= PROBES_PER_GRID) {
        return;
    }
    uint index = push.first + local;
    ProbeGrid grid = probe_grids[push.first / PROBES_PER_GRID];
    Probe probe = probes[index];
    COUNT(WORDS, 14u);
    if (push.step == 0u) {
        ivec3 cell = cell_of(index, grid.first);
        bool kept = push.known != 0u && probe.cell == cell && is_active(probe);
        bool asked = !CLASSIFY || is_asked(cell - grid.first);
        probe.cell = cell;
        probe.state = (asked ? PROBE_ACTIVE : 0u) | (kept ? probe.state & PROBE_FRESH : PROBE_FRESH);
        probe.position = (vec3(cell) + 0.5) * grid.spacing;
    } else if (is_active(probe)) {
        Felt felt = feel(index);
        if (push.step == 1u) {
            vec3 middle = (vec3(probe.cell) + 0.5) * grid.spacing;
            vec3 off = probe.position + probe_move(felt, grid.spacing) - middle;
            float most = MOST_OFFSET * grid.spacing;
            probe.position = middle + clamp(off, vec3(-most), vec3(most));
        } else if (CLASSIFY && float(felt.backs) > INSIDE_SHARE * float(FEELERS)) {
            probe.state &= ~PROBE_ACTIVE;
        }
    }
    probes[index] = probe;
}
