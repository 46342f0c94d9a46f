#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One step of propagation, with a beam in each cell: every cell gathers what its six neighbours send to it, and shares it out
// among them for the next step. What it sends each of them adds up. CPU twin: tests/twins/propagation.rs.

#include "gi/lpv/constants.glsl"
#include "common/count.glsl"
#include "ground/layout.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"
#include "gi/lpv/push.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(set = 0, binding = 0, scalar) readonly buffer FrameBuffer { Frame frame; };
layout(set = 0, binding = 34, scalar) readonly buffer CascadePlaces { vec4 cascades[]; };
layout(set = 0, binding = 36, scalar) readonly buffer Passages { uvec3 passages[]; };
layout(set = 0, binding = 40) uniform sampler3D old_light[7]; // flux, shares
layout(set = 0, binding = 48, rgba32f) uniform image3D sums[6]; // along +x +y +z −x −y −z, the grids one above the other

#include "gi/lpv/beams.glsl"
#include "gi/lpv/new_beams.glsl"

ivec3 in_sums(ivec3 cell, uint cascade) {
    return cell + ivec3(0, 0, cascade * LPV_EDGE);
}

// Where in the next coarser grid's sum a cell beyond the border lies.
ivec3 in_coarser(ivec3 cell) {
    vec3 recorded = (vec3(cell) + 0.5 - push.offset) / push.scale;
    vec4 place = cascades[push.cascade + 1u];
    ivec3 there = clamp(ivec3(floor(recorded * place.w + place.xyz)), ivec3(0), ivec3(LPV_EDGE - 1u));
    return in_sums(there, push.cascade + 1u);
}

// From the neighbour against `way`; what comes in from beyond the border does so once, as it adds up over all steps: the next
// coarser grid's sum, or the sky.
#define GATHER(k, way, open) { \
    ivec3 from = cell - way; \
    bool inside = in_volume(from); \
    ivec3 near = clamp(from, ivec3(0), ivec3(LPV_EDGE - 1u)); \
    vec4 flux = (open) * texelFetch(old_light[0], near, 0); \
    vec4 share = texelFetch(old_light[k + 1], near, 0); \
    if (!inside) { \
        flux = vec4(0.0); \
        share = vec4(1.0, DIFFUSE_COSINE * vec3(way)); \
        if (FIRST_STEP) { \
            flux = (open) * (push.cascade + 1u == CASCADES ? vec4(0.0, 0.0, 0.0, PI) : imageLoad(sums[k], in_coarser(from))); \
        } \
    } \
    beam.flux += flux * share.x; \
    beam.moment += beam_weight(flux) * share.yzw; \
}

#define ADD_UP(k) { \
    vec4 sent = beam.flux * shares.to[k].x; \
    if (!FIRST_STEP) { \
        sent += imageLoad(sums[k], at); \
    } \
    imageStore(sums[k], at, sent); \
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    Passage passage = Passage(vec3(1.0), vec3(1.0));
    if (OCCLUSION == OCCLUSION_SHEETS) {
        passage = unpack_passage(passages[push.cascade * CELLS_PER_GRID + cell_index(cell)]);
    }
    Beam beam = Beam(vec4(0.0), vec3(0.0));
    GATHER(0, ivec3(1, 0, 0), passage.up.x)
    GATHER(1, ivec3(0, 1, 0), passage.up.y)
    GATHER(2, ivec3(0, 0, 1), passage.up.z)
    GATHER(3, ivec3(-1, 0, 0), passage.down.x)
    GATHER(4, ivec3(0, -1, 0), passage.down.y)
    GATHER(5, ivec3(0, 0, -1), passage.down.z)
    COUNT(WORDS, 12u * 4u + 3u + 13u * 4u + 6u * 4u);
    Shares shares = shares_of(beam);
    store_new(cell, beam.flux, shares);
    ivec3 at = in_sums(cell, push.cascade);
    ADD_UP(0)
    ADD_UP(1)
    ADD_UP(2)
    ADD_UP(3)
    ADD_UP(4)
    ADD_UP(5)
}
