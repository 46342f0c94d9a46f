#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! per method
//! with GATHERED except none
//! with AOVS
//! with ASKS only rays
// Image: shades listed fragments. A thread per fragment. With ASKS it requests the light of list items instead. The
// pass with PART_LIGHT takes all fragments, and puts those that need further parts into queues, so that no thread of
// the passes that shade these is idle.

#include "common/spread.glsl"

#define WRITES_FRAGMENTS
#include "ground/image/fragments.glsl"

layout(push_constant) uniform Push {
    uint first_row; // of the image, at the top of this band
    uint first_seen; // of the image, the first row that the band sees
} push;

layout(constant_id) const uint PARTS = 7u; // of a fragment's light

#include "ground/image/shade.glsl"

layout(local_size_x = 64) in;

#ifdef AOVS
layout(rgba32f) uniform image2D shaded[6];
#else
layout(rgba32f) uniform image2D shaded[1];
#endif

void store(Shown shown, ivec2 at) {
    imageStore(shaded[0], at, shown.beauty);
#ifdef AOVS
    imageStore(shaded[1], at, shown.direct);
    imageStore(shaded[2], at, shown.indirect);
    imageStore(shaded[3], at, shown.normal);
    imageStore(shaded[4], at, shown.albedo);
    imageStore(shaded[5], at, shown.ao_depth_diffuse);
#endif
}

// Adds the light of further parts; opacity and the other layers stay.
void add(Shown shown, ivec2 at) {
    imageStore(shaded[0], at, imageLoad(shaded[0], at) + vec4(shown.beauty.rgb, 0.0));
#ifdef AOVS
    imageStore(shaded[1], at, imageLoad(shaded[1], at) + vec4(shown.direct.rgb, 0.0));
    imageStore(shaded[2], at, imageLoad(shaded[2], at) + vec4(shown.indirect.rgb, 0.0));
    imageStore(shaded[5], at, imageLoad(shaded[5], at) + vec4(shown.ao_depth_diffuse.x, vec3(0.0)));
#endif
}

void main() {
    const bool first = has_part(PART_LIGHT);
    const uint queue = first ? 0u : has_part(PART_LOOK_UPS) ? TO_LOOK_UP : WITH_LOBES;
    uint count = min(fragment_counts[queue].count, fragment_room());
    uint block = block_at(gl_WorkGroupID.x, (count + 63u) / 64u);
    uint index = block * 64u + gl_LocalInvocationID.x;
    // Threads beyond the last fragment repeat its work: llvmpipe takes a third longer if main has a branch.
    uint entry = min(index, count - 1u);
    uint needs = 0u;
    if (!first) {
        COUNT(WORDS, 1u);
        uint queued = entry_of_queue(queue, entry);
        entry = queued >> NEEDS_BITS;
        needs = queued & (1u << NEEDS_BITS) - 1u;
    }
    COUNT(WORDS, 3u);
    Fragment f = fragments[entry];
    uvec2 pixel = place_of(f) + uvec2(0u, push.first_seen);
    uint seen = seen_of(f);
    bool back = (seen & 1u) == 0u;
    Shown shown = shade((seen - 1u) / 2u, back, pixel, samples_of(f), (f.seen & BEHIND) == 0u, needs);
#ifndef ASKS
    ivec2 at = fragment_texel(entry, imageSize(shaded[0]).x);
    if (first) {
        store(shown, at);
    } else if (index < count) {
        add(shown, at);
    }
#endif
    if (first && index < count) {
        if (!has_part(PART_LOOK_UPS) && (needs & NEEDS_LOOK_UPS) != 0u) {
            put_in_queue(TO_LOOK_UP, entry << NEEDS_BITS | needs);
        }
        if (!has_part(PART_LOBES) && (needs & NEEDS_LOBES) != 0u) {
            put_in_queue(WITH_LOBES, entry << NEEDS_BITS | needs);
        }
    }
}
