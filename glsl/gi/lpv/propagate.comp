#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One step of propagation in lobes: every cell gathers the light that its six neighbours send to five of its faces, and
// sends it on as lobes about the directions of these faces (Doghramachi, GPU Pro 4, listing 7.3). CPU twin:
// tests/twins/propagation.rs.

#include "gi/lpv/constants.glsl"
#include "common/count.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"
#include "gi/lpv/push.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(scalar) readonly buffer BlockersBuffer { uvec4 blockers[]; };
layout(scalar) readonly buffer CascadePlaces { vec4 cascades[]; };
layout(scalar) readonly buffer Passages { uvec3 passages[]; };
uniform sampler3D old_light[4];
#include "gi/lpv/new_light.glsl"
layout(rgba32f) uniform image3D sums[4]; // the grids stacked along z

Field light_in(ivec3 cell) {
    return Field(texelFetch(old_light[0], cell, 0), texelFetch(old_light[1], cell, 0),
        texelFetch(old_light[2], cell, 0), texelFetch(old_light[3], cell, 0));
}

Field sum_in(ivec3 at) {
    return Field(imageLoad(sums[0], at), imageLoad(sums[1], at), imageLoad(sums[2], at), imageLoad(sums[3], at));
}

ivec3 in_sums(ivec3 cell, uint cascade) {
    return cell + ivec3(0, 0, cascade * LPV_EDGE);
}

// Light that enters from beyond the border, once, summed over all steps: that of the next coarser grid, or the sky.
Field light_outside(ivec3 cell) {
    if (push.cascade + 1u == CASCADES) {
        return Field(vec4(0.0, 0.0, 0.0, EVEN_FLUX), vec4(0.0), vec4(0.0), vec4(0.0));
    }
    vec3 recorded = (vec3(cell) + 0.5 - push.offset) / push.scale;
    vec4 place = cascades[push.cascade + 1u];
    ivec3 there = clamp(ivec3(floor(recorded * place.w + place.xyz)), ivec3(0), ivec3(LPV_EDGE - 1u));
    return sum_in(in_sums(there, push.cascade + 1u));
}

// The share that the surfaces between two cells let pass in a direction, in two bands: the even part, then the parts
// along the axes.
float passes(vec4 occluder, float x, float y, float z) {
    return OCCLUSION == OCCLUSION_SH
        ? 1.0 - clamp(occluder.x + occluder.y * x + occluder.z * y + occluder.w * z, 0.0, 1.0)
        : 1.0;
}

vec4 at_least_none(vec4 intensity) {
    return max(intensity, vec4(0.0));
}

// The share of light at a face that is sent on: its lobe has the integral 4π, or π, divided by 4π.
const float SENT_ON = LOBE == LOBE_COSINE_PI ? 0.25 : 1.0;

// A neighbour's light on five faces, and the light that they send on. Here and in the result, x is along the direction
// of travel.
Field spread(Field f, vec4 occluder) {
    vec4 ahead = f.flux + SIDE_ALONG * f.x;
    vec4 y = SIDE_ACROSS * f.y;
    vec4 z = SIDE_ACROSS * f.z;
    vec4 opposite = OPPOSITE * passes(occluder, 1.0, 0.0, 0.0) * at_least_none(f.flux + f.x);
    vec4 up = SIDE * passes(occluder, SIDE_ALONG, SIDE_ACROSS, 0.0) * at_least_none(ahead + y);
    vec4 down = SIDE * passes(occluder, SIDE_ALONG, -SIDE_ACROSS, 0.0) * at_least_none(ahead - y);
    vec4 left = SIDE * passes(occluder, SIDE_ALONG, 0.0, SIDE_ACROSS) * at_least_none(ahead + z);
    vec4 right = SIDE * passes(occluder, SIDE_ALONG, 0.0, -SIDE_ACROSS) * at_least_none(ahead - z);
    return scaled(
        Field(opposite + (up + down) + (left + right), 2.0 * opposite, 2.0 * (up - down), 2.0 * (left - right)),
        SENT_ON);
}

// The light of the neighbour. Light from beyond the border enters in the first step, which has its own pipeline,
// because a CPU device executes both sides of every branch.
Field neighbour(ivec3 cell) {
    Field f = light_in(clamp(cell, ivec3(0), ivec3(LPV_EDGE - 1u)));
    if (!in_volume(cell)) {
        f = no_light();
        if (FIRST_STEP) {
            f = light_outside(cell);
        }
    }
    return f;
}

Blockers blockers_in(ivec3 cell) {
    return unpack_blockers(
        blockers[push.cascade * CELLS_PER_GRID + cell_index(clamp(cell, ivec3(0), ivec3(LPV_EDGE - 1u)))]);
}

// In two bands: the mean of the surfaces of both cells, half a cell off along the direction of travel. One-sided
// surfaces block light that meets their front.
vec4 occluder(Blockers here, ivec3 from) {
    if (OCCLUSION != OCCLUSION_SH || FIRST_STEP) {
        return vec4(0.0); // no blocking: with INJECTION_CELL, its own surface would block light
    }
    Blockers there = blockers_in(from);
    return vec4(here.even + there.even, here.down - here.up + there.down - there.up) * vec4(0.5, vec3(0.25));
}

// Light from three neighbours: that which travels upwards along the axes, or downwards.
void gather(inout Field sum, ivec3 cell, Blockers here, int sign, vec3 open) {
    float s = float(sign);
    Field x = neighbour(cell - ivec3(sign, 0, 0));
    vec4 o = occluder(here, cell - ivec3(sign, 0, 0));
    Field f = scaled(spread(Field(x.flux, s * x.x, x.y, x.z), vec4(o.x, s * o.y, o.z, o.w)), open.x);
    sum = add(sum, Field(f.flux, s * f.x, f.y, f.z));
    Field y = neighbour(cell - ivec3(0, sign, 0));
    o = occluder(here, cell - ivec3(0, sign, 0));
    f = scaled(spread(Field(y.flux, s * y.y, y.z, y.x), vec4(o.x, s * o.z, o.w, o.y)), open.y);
    sum = add(sum, Field(f.flux, f.z, s * f.x, f.y));
    Field z = neighbour(cell - ivec3(0, 0, sign));
    o = occluder(here, cell - ivec3(0, 0, sign));
    f = scaled(spread(Field(z.flux, s * z.z, z.x, z.y), vec4(o.x, s * o.w, o.y, o.z)), open.z);
    sum = add(sum, Field(f.flux, f.y, f.z, s * f.x));
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    uint index = cell_index(cell);
    Blockers here = OCCLUSION == OCCLUSION_SH ? blockers_in(cell) : Blockers(vec3(0.0), vec3(0.0), 0.0);
    Passage passage = OCCLUSION == OCCLUSION_SHEETS ? unpack_passage(passages[push.cascade * CELLS_PER_GRID + index])
                                                    : Passage(vec3(1.0), vec3(1.0));
    Field sum = no_light();
    if (SUM == SUM_OWN) {
        sum = light_in(cell);
    }
    gather(sum, cell, here, 1, passage.up);
    gather(sum, cell, here, -1, passage.down);
    COUNT(WORDS, 6u * 16u + 3u + 32u);
    store_new(cell, sum);
    ivec3 at = in_sums(cell, push.cascade);
    if (SUM == SUM_APART && !FIRST_STEP) {
        sum = add(sum, sum_in(at));
    }
    imageStore(sums[0], at, sum.flux);
    imageStore(sums[1], at, sum.x);
    imageStore(sums[2], at, sum.y);
    imageStore(sums[3], at, sum.z);
}
