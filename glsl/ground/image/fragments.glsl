// Visible triangles, with one entry for each pixel and triangle, so that no thread is idle however small triangles are.
// Shaders that write the list or its queues define WRITES_FRAGMENTS. Twin: src/ground/image/fragments.rs.
//! with WRITES_FRAGMENTS

#include "ground/constants.glsl"
#include "ground/layout.glsl"

struct Fragment {
    uint place; // of the pixel: across, down, within a band; above them, the samples that see the triangle
    uint seen; // as in the visibility buffer; with BEHIND for a blended surface that others hide in all its samples
};

const uint BEHIND = 1u << 31u;

const uint ACROSS_BITS = 15u;
const uint PLACE_BITS = 28u;
const uint COUNT_BITS = 3u;

#ifdef WRITES_FRAGMENTS
#define FRAGMENTS_ACCESS
#else
#define FRAGMENTS_ACCESS readonly
#endif

// Queues of the fragments that need further passes; both may have all fragments.
const uint TO_LOOK_UP = 1u;
const uint WITH_LOBES = 2u;
const uint COUNTS = 3u; // of all fragments, and of each queue

layout(scalar) FRAGMENTS_ACCESS buffer Fragments {
    ListCount fragment_counts[COUNTS]; // groups of 64 fragments, and their number
    Fragment fragments[]; // the second half has the queues: an entry of the first as place, one of the second as seen
};

// The capacity for fragments.
uint fragment_room() {
    return uint(fragments.length()) / 2u;
}

// For each pixel that a band sees: the start of its fragments, and in the low bits their number.
layout(scalar) FRAGMENTS_ACCESS buffer PixelFragments { uint pixel_fragments[]; };

#ifdef WRITES_FRAGMENTS
// Reserves room for `count` more fragments; returns the first slot.
uint take_slots(uint count) {
    uint slot = count > 0u ? atomicAdd(fragment_counts[0].count, count) : 0u;
    uint groups = (slot + count + 63u) / 64u;
    if (groups > (slot + 63u) / 64u) {
        atomicMax(fragment_counts[0].groups_x, min(groups, MOST_GROUPS));
    }
    return slot;
}

// Adds an entry to a queue. The order depends on the order of threads; the light of each entry does not.
void put_in_queue(uint queue, uint entry) {
    uint at = atomicAdd(fragment_counts[queue].count, 1u);
    if (at % 64u == 0u) {
        atomicMax(fragment_counts[queue].groups_x, min(at / 64u + 1u, MOST_GROUPS));
    }
    if (queue == TO_LOOK_UP) {
        fragments[fragment_room() + at].place = entry;
    } else {
        fragments[fragment_room() + at].seen = entry;
    }
}
#endif

uint entry_of_queue(uint queue, uint at) {
    return queue == TO_LOOK_UP ? fragments[fragment_room() + at].place : fragments[fragment_room() + at].seen;
}

Fragment fragment(uvec2 place, uint covered, uint seen) {
    return Fragment(place.x | place.y << ACROSS_BITS | covered << PLACE_BITS, seen);
}

uvec2 place_of(Fragment f) {
    return uvec2(
        f.place & (1u << ACROSS_BITS) - 1u, bitfieldExtract(f.place, int(ACROSS_BITS), int(PLACE_BITS - ACROSS_BITS)));
}

uint seen_of(Fragment f) {
    return f.seen & ~BEHIND;
}

uint samples_of(Fragment f) {
    return f.place >> PLACE_BITS;
}

// The position of a shaded fragment in images of that width.
ivec2 fragment_texel(uint slot, int width) {
    return ivec2(slot % uint(width), slot / uint(width));
}
