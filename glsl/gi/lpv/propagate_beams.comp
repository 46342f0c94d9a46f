#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One step of propagation with a beam in each cell: every cell gathers the light that its six neighbours send, and
// distributes it among them for the next step. The light sent to each is summed. CPU twin: tests/twins/propagation.rs.

#include "gi/lpv/constants.glsl"
#include "common/count.glsl"
#include "ground/layout.glsl"
#include "gi/lpv/field.glsl"
#include "gi/lpv/blockers.glsl"
#include "gi/lpv/push.glsl"

// Workgroups are rows, so that a CPU device has their cells in one vector.
layout(local_size_x = 16, local_size_y = 4) in;

#include "ground/frame.glsl"
layout(scalar) readonly buffer CascadePlaces { vec4 cascades[]; };
layout(scalar) readonly buffer Passages { uvec3 passages[]; };
uniform sampler3D old_light[2]; // a KeptBeam
layout(rgba32f) uniform image3D sums[6]; // along +x +y +z −x −y −z, the grids stacked along z

#include "gi/lpv/beams.glsl"
#include "gi/lpv/new_beams.glsl"

ivec3 in_sums(ivec3 cell, uint cascade) {
    return cell + ivec3(0, 0, cascade * LPV_EDGE);
}

// The position in the next coarser grid's sum of a cell beyond the border.
ivec3 in_coarser(ivec3 cell) {
    vec3 recorded = (vec3(cell) + 0.5 - push.offset) / push.scale;
    vec4 place = cascades[push.cascade + 1u];
    ivec3 there = clamp(ivec3(floor(recorded * place.w + place.xyz)), ivec3(0), ivec3(LPV_EDGE - 1u));
    return in_sums(there, push.cascade + 1u);
}

// Light from the neighbour against `way`. PARTS is the neighbour's mean direction in a frame along `way`, in which it
// sends the share `s`; MOMENT is the same direction in the grid's frame. Light from beyond the border enters once,
// summed over all steps: that of the next coarser grid, or the sky.
#define GATHER(k, way, open, PARTS, MOMENT) \
    { \
        ivec3 from = cell - way; \
        bool inside = in_volume(from); \
        ivec3 near = clamp(from, ivec3(0), ivec3(LPV_EDGE - 1u)); \
        vec4 old = texelFetch(old_light[1], near, 0); \
        vec3 g = old.xyz; \
        vec4 s = old.w * share_along(PARTS, 1.0 + dot(g, g)); \
        vec4 flux = (inside ? open : 0.0) * texelFetch(old_light[0], near, 0); \
        beam.flux += flux * s.x; \
        beam.moment += beam_weight(flux) * MOMENT; \
        if (FIRST_STEP && !inside) { \
            flux = (open) \
                * (push.cascade + 1u == CASCADES ? vec4(0.0, 0.0, 0.0, PI) : imageLoad(sums[k], in_coarser(from))); \
            beam.flux += flux; \
            beam.moment += beam_weight(flux) * DIFFUSE_COSINE * vec3(way); \
        } \
    }

#define ADD_UP(k) \
    { \
        vec4 sent = kept.flux * (kept.direction.w * aim.to[k]); \
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
    GATHER(0, ivec3(1, 0, 0), passage.up.x, g, s.yzw)
    GATHER(1, ivec3(0, 1, 0), passage.up.y, g.yzx, s.wyz)
    GATHER(2, ivec3(0, 0, 1), passage.up.z, g.zxy, s.zwy)
    GATHER(3, ivec3(-1, 0, 0), passage.down.x, vec3(-g.x, g.yz), vec3(-s.y, s.z, s.w))
    GATHER(4, ivec3(0, -1, 0), passage.down.y, vec3(-g.y, g.zx), vec3(s.w, -s.y, s.z))
    GATHER(5, ivec3(0, 0, -1), passage.down.z, vec3(-g.z, g.xy), vec3(s.z, s.w, -s.y))
    COUNT(WORDS, 12u * 4u + 3u + 2u * 4u + 12u * 4u);
    Aim aim = aim_of(beam);
    KeptBeam kept = kept_beam(beam, aim);
    store_new(cell, kept);
    ivec3 at = in_sums(cell, push.cascade);
    ADD_UP(0)
    ADD_UP(1)
    ADD_UP(2)
    ADD_UP(3)
    ADD_UP(4)
    ADD_UP(5)
}
