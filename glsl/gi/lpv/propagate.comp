#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One step of propagation: every cell gathers, from its six neighbours, what they send onto the five of its faces that they
// see, and sends it on as lobes about these faces' directions (Doghramachi, GPU Pro 4, listing 7.3). CPU twin:
// tests/twins/propagation.rs.

#include "gi/lpv/constants.glsl"
#include "common/count.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"
#include "gi/lpv/push.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(set = 0, binding = 32, scalar) buffer Sums { vec4 sums[]; };
layout(set = 0, binding = 33, scalar) readonly buffer BlockersBuffer { uvec4 blockers[]; };
layout(set = 0, binding = 34, scalar) readonly buffer CascadePlaces { vec4 cascades[]; };
layout(set = 0, binding = 37, scalar) writeonly buffer NewLight { vec4 new_light[]; };
layout(set = 0, binding = 38, scalar) readonly buffer OldLight { vec4 old_light[]; };

Field light_in(uint index) {
    return Field(old_light[index], old_light[CELLS_PER_GRID + index], old_light[2u * CELLS_PER_GRID + index],
        old_light[3u * CELLS_PER_GRID + index]);
}

// What comes in from beyond the border, once, as it adds up over all steps: the next coarser grid's sum, or the sky.
Field light_outside(ivec3 cell) {
    if (push.cascade + 1u == CASCADES) {
        return Field(vec4(0.0, 0.0, 0.0, EVEN_FLUX), vec4(0.0), vec4(0.0), vec4(0.0));
    }
    vec3 recorded = (vec3(cell) + 0.5 - push.offset) / push.scale;
    vec4 place = cascades[push.cascade + 1u];
    uint index = cell_index(clamp(ivec3(floor(recorded * place.w + place.xyz)), ivec3(0), ivec3(LPV_EDGE - 1u)));
    uint first = 4u * (push.cascade + 1u) * CELLS_PER_GRID + index;
    return Field(sums[first], sums[first + CELLS_PER_GRID], sums[first + 2u * CELLS_PER_GRID], sums[first + 3u * CELLS_PER_GRID]);
}

// Share that the surfaces between two cells let pass towards a direction, in two bands: even part, then the parts along the axes.
float passes(vec4 occluder, float x, float y, float z) {
    return OCCLUSION == OCCLUSION_SH ? 1.0 - clamp(occluder.x + occluder.y * x + occluder.z * y + occluder.w * z, 0.0, 1.0) : 1.0;
}

vec4 at_least_none(vec4 intensity) {
    return LOBE == LOBE_EVEN ? intensity : max(intensity, vec4(0.0));
}

// A neighbour's light onto five faces, and what they send on. Here and in the result x is the way, y and z are across.
Field spread(Field f, vec4 occluder) {
    vec4 ahead = f.flux + SIDE_ALONG * f.x;
    vec4 y = SIDE_ACROSS * f.y;
    vec4 z = SIDE_ACROSS * f.z;
    vec4 opposite = OPPOSITE * passes(occluder, 1.0, 0.0, 0.0) * at_least_none(f.flux + f.x);
    vec4 up = SIDE * passes(occluder, SIDE_ALONG, SIDE_ACROSS, 0.0) * at_least_none(ahead + y);
    vec4 down = SIDE * passes(occluder, SIDE_ALONG, -SIDE_ACROSS, 0.0) * at_least_none(ahead - y);
    vec4 left = SIDE * passes(occluder, SIDE_ALONG, 0.0, SIDE_ACROSS) * at_least_none(ahead + z);
    vec4 right = SIDE * passes(occluder, SIDE_ALONG, 0.0, -SIDE_ACROSS) * at_least_none(ahead - z);
    return Field(opposite + (up + down) + (left + right), LOBE_FACTOR * opposite, LOBE_FACTOR * (up - down), LOBE_FACTOR * (left - right));
}

// The neighbour against the way: its light, and what stands between.
struct Neighbour {
    Field light;
    Blockers blockers;
};

Neighbour neighbour(ivec3 cell) {
    bool inside = in_volume(cell);
    uint index = cell_index(clamp(cell, ivec3(0), ivec3(LPV_EDGE - 1u)));
    Neighbour n = Neighbour(light_in(index), unpack_blockers(blockers[push.cascade * CELLS_PER_GRID + index]));
    if (!inside) {
        n.light = no_light();
        n.blockers = Blockers(vec3(0.0), vec3(0.0), 0.0);
        if (push.first != 0u) {
            n.light = light_outside(cell);
        }
    }
    return n;
}

// In two bands: the mean of both cells' surfaces, half a cell off along the way. One-sided ones block what meets their front.
vec4 occluder(Blockers here, Blockers there) {
    return vec4(here.even + there.even, here.down - here.up + there.down - there.up) * vec4(0.5, vec3(0.25));
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    uint index = cell_index(cell);
    Blockers here = unpack_blockers(blockers[push.cascade * CELLS_PER_GRID + index]);
    vec3 entry = 1.0 - across(here);
    // The first step is not blocked: with `cell` a light would be by its own surface.
    bool blocks = OCCLUSION == OCCLUSION_SHEETS || OCCLUSION == OCCLUSION_SH && push.first == 0u;
    Field sum = SUM == SUM_OWN ? light_in(index) : no_light();
    for (int sign = -1; sign <= 1; sign += 2) {
        float s = float(sign);
        Neighbour x = neighbour(cell - ivec3(sign, 0, 0));
        Neighbour y = neighbour(cell - ivec3(0, sign, 0));
        Neighbour z = neighbour(cell - ivec3(0, 0, sign));
        vec4 ox = blocks ? occluder(here, x.blockers) : vec4(0.0);
        vec4 oy = blocks ? occluder(here, y.blockers) : vec4(0.0);
        vec4 oz = blocks ? occluder(here, z.blockers) : vec4(0.0);
        Field fx = spread(Field(x.light.flux, s * x.light.x, x.light.y, x.light.z), vec4(ox.x, s * ox.y, ox.z, ox.w));
        Field fy = spread(Field(y.light.flux, s * y.light.y, y.light.z, y.light.x), vec4(oy.x, s * oy.z, oy.w, oy.y));
        Field fz = spread(Field(z.light.flux, s * z.light.z, z.light.x, z.light.y), vec4(oz.x, s * oz.w, oz.y, oz.z));
        if (OCCLUSION == OCCLUSION_SHEETS) {
            // A cell's light is in front of what stands in it. It is blocked where it would leave through a surface's front, and
            // where it would come into a cell through a surface, from either side.
            bool up = sign > 0;
            fx = scaled(fx, entry.x * (1.0 - (up ? x.blockers.down.x : x.blockers.up.x)));
            fy = scaled(fy, entry.y * (1.0 - (up ? y.blockers.down.y : y.blockers.up.y)));
            fz = scaled(fz, entry.z * (1.0 - (up ? z.blockers.down.z : z.blockers.up.z)));
        }
        sum = add(sum, Field(fx.flux, s * fx.x, fx.y, fx.z));
        sum = add(sum, Field(fy.flux, fy.z, s * fy.x, fy.y));
        sum = add(sum, Field(fz.flux, fz.y, fz.z, s * fz.x));
    }
    COUNT(WORDS, 7u * 16u + 7u * 4u + 32u);
    new_light[index] = sum.flux;
    new_light[CELLS_PER_GRID + index] = sum.x;
    new_light[2u * CELLS_PER_GRID + index] = sum.y;
    new_light[3u * CELLS_PER_GRID + index] = sum.z;
    uint first = 4u * push.cascade * CELLS_PER_GRID + index;
    bool adds = SUM == SUM_APART && push.first == 0u;
    Field before = no_light();
    if (adds) {
        before = Field(sums[first], sums[first + CELLS_PER_GRID], sums[first + 2u * CELLS_PER_GRID], sums[first + 3u * CELLS_PER_GRID]);
    }
    sums[first] = before.flux + sum.flux;
    sums[first + CELLS_PER_GRID] = before.x + sum.x;
    sums[first + 2u * CELLS_PER_GRID] = before.y + sum.y;
    sums[first + 3u * CELLS_PER_GRID] = before.z + sum.z;
}
