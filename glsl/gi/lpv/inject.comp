#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with BEAMS
// Virtual point lights: the light of the surfaces in a cell's list starts in that cell or, with INJECTION_FRONT, in the
// cell in front of them, because light in a surface's own cell would light that surface and be blocked by it. A thread
// per cell collects the light, so that sums have a fixed order. It also collects the blocking areas of the cell.

#include "gi/lpv/constants.glsl"
#include "common/count.glsl"
#include "common/dominant_axis.glsl"
#include "common/triangle_box.glsl"
#include "ground/layout.glsl"
#include "ground/heads.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"
#include "common/fixed_sum.glsl"
#include "gi/lpv/push.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
layout(scalar) readonly buffer Materials { Material materials[]; };
layout(scalar) readonly buffer ItemLights { ItemLight item_lights[]; };
layout(scalar) writeonly buffer BlockersBuffer { uvec4 blockers[]; };
layout(scalar) readonly buffer GridItems { ListItem grid_items[]; };
layout(scalar) readonly buffer GridHeads { uint grid_heads[]; };
#ifdef BEAMS
#include "ground/frame.glsl"
#include "gi/lpv/beams.glsl"
#include "gi/lpv/new_beams.glsl"
#else
#include "gi/lpv/new_light.glsl"
#endif

struct Collected {
    FixedSum flux;
    FixedSum x;
    FixedSum y;
    FixedSum z;
};

void collect(inout Collected sum, vec3 sent, vec3 n) {
    Field f = lobe(vec4(PI * sent, 0.0), n);
    fixed_add(sum.flux, f.flux);
    fixed_add(sum.x, f.x);
    fixed_add(sum.y, f.y);
    fixed_add(sum.z, f.z);
}

// Adds the light that the list of `cell` sends along `way`; all of its light if `way` is 0.
void collect_list(inout Collected sum, ivec3 cell, ivec3 way) {
    uint item = grid_heads[cell_index(cell)];
    COUNT(HEADS, 1u);
    for (uint k = 0u; k < uint(grid_items.length()) && item != 0u; k++) {
        ListItem entry = grid_items[item - 1u];
        ItemLight light = item_lights[item - 1u];
        COUNT(LIST_ITEMS, 1u);
        COUNT(WORDS, 8u);
        COUNT(CORNERS, 3u);
        vec3 n = normalize(triangle_normal(triangles[entry.triangle].corners[0], triangles[entry.triangle].corners[1],
            triangles[entry.triangle].corners[2]));
        float along = dot(n, vec3(way));
        bool goes = way == ivec3(0) || abs(way[dominant_axis(n)]) == 1;
        float part = light.opacity * light.area;
        if (goes && along >= 0.0) {
            collect(sum, light.front * part, n);
        }
        if (goes && along <= 0.0) {
            collect(sum, light.back * part, -n);
        }
        item = entry.next;
    }
}

Blockers blockers_of(ivec3 cell) {
    FixedSum up = fixed_zero();
    FixedSum down = fixed_zero();
    uint item = grid_heads[cell_index(cell)];
    for (uint k = 0u; k < uint(grid_items.length()) && item != 0u; k++) {
        ListItem entry = grid_items[item - 1u];
        ItemLight light = item_lights[item - 1u];
        COUNT(LIST_ITEMS, 1u);
        COUNT(CORNERS, 3u);
        vec3 n = normalize(triangle_normal(triangles[entry.triangle].corners[0], triangles[entry.triangle].corners[1],
            triangles[entry.triangle].corners[2]));
        bool two_sided = (materials[triangles[entry.triangle].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
        float area = light.opacity * light.area;
        vec3 front = area * max(n, vec3(0.0));
        vec3 back = area * max(-n, vec3(0.0));
        fixed_add(up, vec4(two_sided ? front + back : front, two_sided ? 0.5 * area : 0.25 * area));
        fixed_add(down, vec4(two_sided ? front + back : back, 0.0));
        item = entry.next;
    }
    vec4 looks_up = fixed_signed_value(up);
    return Blockers(min(looks_up.xyz, vec3(1.0)), min(fixed_signed_value(down).xyz, vec3(1.0)), looks_up.w);
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    uint index = cell_index(cell);
    Blockers here = blockers_of(cell);
    Field started = no_light();
    if (INJECTION == INJECTION_CELL) {
        Collected sum = Collected(fixed_zero(), fixed_zero(), fixed_zero(), fixed_zero());
        collect_list(sum, cell, ivec3(0));
        started = Field(fixed_signed_value(sum.flux), fixed_signed_value(sum.x), fixed_signed_value(sum.y),
            fixed_signed_value(sum.z));
    } else {
        vec3 open = 1.0 - across(here);
        for (int k = 0; k < 6; k++) {
            ivec3 way = ivec3(0);
            way[k % 3] = k < 3 ? 1 : -1;
            if (in_volume(cell - way)) {
                Collected sum = Collected(fixed_zero(), fixed_zero(), fixed_zero(), fixed_zero());
                collect_list(sum, cell - way, way);
                Field f = Field(fixed_signed_value(sum.flux), fixed_signed_value(sum.x), fixed_signed_value(sum.y),
                    fixed_signed_value(sum.z));
                started = add(started, scaled(f, OCCLUSION == OCCLUSION_SHEETS ? open[k % 3] : 1.0));
            }
        }
    }
    blockers[push.cascade * CELLS_PER_GRID + index] = pack_blockers(here);
#ifdef BEAMS
    // The mean cosine of two bands is a third of their moment: 2/3 for a clamped cosine.
    Beam beam = Beam(started.flux, vec3(beam_weight(started.x), beam_weight(started.y), beam_weight(started.z)) / 3.0);
    store_new(cell, kept_beam(beam, aim_of(beam)));
#else
    store_new(cell, started);
#endif
}
