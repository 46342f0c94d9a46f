#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MULTISAMPLED
// Lists the fragments of what a band sees. A thread for some pixels beside each other.

#include "common/count.glsl"

#define LISTS_FRAGMENTS
#include "ground/image/fragments.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

#ifdef MULTISAMPLED
uniform usampler2DMS seen;
const uint PIXEL_SAMPLES = 4u;
#else
uniform usampler2D seen;
const uint PIXEL_SAMPLES = 1u;
#endif

layout(push_constant) uniform Push {
    uint first; // rows of those that the band sees
    uint end;
} push;

// Neighbours for which a thread asks for room at once; a bit for each sample of all of them fits into a word.
const uint RUN = 8u;

uint width() {
#ifdef MULTISAMPLED
    return uint(textureSize(seen).x);
#else
    return uint(textureSize(seen, 0).x);
#endif
}

void main() {
    uvec2 first = uvec2(gl_GlobalInvocationID.x * RUN, push.first + gl_GlobalInvocationID.y);
    uint count_across = first.y < push.end ? min(RUN, max(width(), first.x) - first.x) : 0u;
    uint new = 0u; // the samples that see a triangle that none before them in their pixel sees
    for (uint k = 0u; k < count_across; k++) {
        uint before[PIXEL_SAMPLES];
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            before[i] = texelFetch(seen, ivec2(first.x + k, first.y), int(i)).r;
            bool is_new = before[i] != 0u;
            for (uint j = 0u; j < i; j++) {
                is_new = is_new && before[j] != before[i];
            }
            new |= is_new ? 1u << (k * PIXEL_SAMPLES + i) : 0u;
        }
    }
    uint count = uint(bitCount(new));
    uint slot = count > 0u ? atomicAdd(fragment_count.count, count) : 0u;
    uint groups = (slot + count + 63u) / 64u;
    if (groups > (slot + 63u) / 64u) {
        atomicMax(fragment_count.groups_x, min(groups, MOST_GROUPS));
    }
    for (uint k = 0u; k < count_across; k++) {
        uvec2 place = uvec2(first.x + k, first.y);
        uint of_pixel = new >> (k * PIXEL_SAMPLES) & (1u << PIXEL_SAMPLES) - 1u;
        pixel_fragments[place.y * width() + place.x] = slot << COUNT_BITS | uint(bitCount(of_pixel));
        COUNT(WORDS, 2u * PIXEL_SAMPLES + 1u + 2u * uint(bitCount(of_pixel)));
        uint ids[PIXEL_SAMPLES];
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            ids[i] = texelFetch(seen, ivec2(place), int(i)).r;
        }
        for (uint left = of_pixel; left != 0u; left &= left - 1u) {
            uint id = ids[findLSB(left)];
            uint covered = 0u;
            for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
                covered |= ids[i] == id ? 1u << i : 0u;
            }
            fragments[slot++] = fragment(place, covered, id);
        }
    }
}
