#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MULTISAMPLED
// Lists the fragments of what a band sees. A thread per pixel.

#include "common/count.glsl"

#define LISTS_FRAGMENTS
#include "ground/image/fragments.glsl"

layout(local_size_x = 64) in;

#ifdef MULTISAMPLED
uniform usampler2DMS seen;
const uint PIXEL_SAMPLES = 4u;
#else
uniform usampler2D seen;
const uint PIXEL_SAMPLES = 1u;
#endif

layout(push_constant) uniform Push {
    uint first; // pixels
    uint end;
} push;

void main() {
#ifdef MULTISAMPLED
    uint width = uint(textureSize(seen).x);
#else
    uint width = uint(textureSize(seen, 0).x);
#endif
    for (uint place = push.first + gl_GlobalInvocationID.x; place < push.end;
         place += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        ivec2 at = ivec2(place % width, place / width);
        uint ids[PIXEL_SAMPLES];
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            ids[i] = texelFetch(seen, at, int(i)).r;
        }
        uint first_samples = 0u; // of each triangle
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            bool listed = ids[i] == 0u;
            for (uint j = 0u; j < i; j++) {
                listed = listed || ids[j] == ids[i];
            }
            first_samples |= listed ? 0u : 1u << i;
        }
        uint count = uint(bitCount(first_samples));
        uint slot = count > 0u ? atomicAdd(fragment_count.count, count) : 0u;
        uint groups = (slot + count + 63u) / 64u;
        if (groups > (slot + 63u) / 64u) {
            atomicMax(fragment_count.groups_x, min(groups, MOST_GROUPS));
        }
        COUNT(WORDS, PIXEL_SAMPLES + 1u + 2u * count);
        pixel_fragments[place] = slot << COUNT_BITS | count;
        for (uint left = first_samples; left != 0u; left &= left - 1u) {
            uint id = ids[findLSB(left)];
            uint covered = 0u;
            for (uint j = 0u; j < PIXEL_SAMPLES; j++) {
                covered |= ids[j] == id ? 1u << j : 0u;
            }
            fragments[slot++] = Fragment(place | covered << PLACE_BITS, id);
        }
    }
}
