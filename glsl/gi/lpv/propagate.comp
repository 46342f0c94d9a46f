#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One step of propagation in lobes: every cell gathers, from its six neighbours, what they send onto the five of its
// faces that they see, and sends it on as lobes about these faces' directions (Doghramachi, GPU Pro 4, listing 7.3).
// CPU twin: tests/twins/propagation.rs.

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
layout(rgba32f) uniform image3D sums[4]; // the grids one above the other

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

// Light that comes in from beyond the border, once, as it adds up over all steps: the next coarser grid's sum, or the
// sky.
Field light_outside(ivec3 cell) {
    if (push.cascade + 1u == CASCADES) {
        return Field(vec4(0.0, 0.0, 0.0, EVEN_FLUX), vec4(0.0), vec4(0.0), vec4(0.0));
    }
    vec3 recorded = (vec3(cell) + 0.5 - push.offset) / push.scale;
    vec4 place = cascades[push.cascade + 1u];
    ivec3 there = clamp(ivec3(floor(recorded * place.w + place.xyz)), ivec3(0), ivec3(LPV_EDGE - 1u));
    return sum_in(in_sums(there, push.cascade + 1u));
}

// Share that the surfaces between two cells let pass towards a direction, in two bands: even part, then the parts along
// the axes.
float passes(vec4 occluder, float x, float y, float z) {
    return OCCLUSION == OCCLUSION_SH
        ? 1.0 - clamp(occluder.x + occluder.y * x + occluder.z * y + occluder.w * z, 0.0, 1.0)
        : 1.0;
}

vec4 at_least_none(vec4 intensity) {
    return max(intensity, vec4(0.0));
}

// Of what meets a face, the share that it sends on: its lobe has the integral 4π, or π, and Ω is divided by 4π.
const float SENT_ON = LOBE == LOBE_COSINE_PI ? 0.25 : 1.0;

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
    return scaled(
        Field(opposite + (up + down) + (left + right), 2.0 * opposite, 2.0 * (up - down), 2.0 * (left - right)),
        SENT_ON);
}

// The neighbour's light. What comes in from beyond the border does so in the first step, which has a pipeline of its
// own: a CPU device goes through both sides of every branch.
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

// In two bands: the mean of both cells' surfaces, half a cell off along the way. One-sided ones block what meets their
// front.
vec4 occluder(Blockers here, ivec3 from) {
    if (OCCLUSION != OCCLUSION_SH || FIRST_STEP) {
        return vec4(0.0); // the first step is not blocked: with `cell` a light would be by its own surface
    }
    Blockers there = blockers_in(from);
    return vec4(here.even + there.even, here.down - here.up + there.down - there.up) * vec4(0.5, vec3(0.25));
}

// From three neighbours: light that travels upwards along the axes, or downwards.
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
