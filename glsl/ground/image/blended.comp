#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Makes fragments from the samples of blended triangles: one for all samples of a pixel that see a triangle, sorted
// back to front, and for equal depths in the scene's order. Marks fragments with others in front. A thread per pixel.

#define WRITES_FRAGMENTS
#include "common/count.glsl"
#include "ground/frame.glsl"
#include "ground/image/fragments.glsl"
#include "ground/image/blended_samples.glsl"

layout(local_size_x = 64) in;

layout(scalar) readonly buffer Triangles { Triangle triangles[]; };
// For each pixel that a band sees: the start and the number of its fragments.
layout(scalar) writeonly buffer BlendedOfPixels { uvec2 blended_of_pixels[]; };

layout(push_constant) uniform Push {
    uint first; // rows relative to those that the band sees
    uint end;
} push;

uint source_of(BlendedSample a) {
    return triangles[(a.seen - 1u) / 2u].source;
}

// Whether entry a precedes entry b: by depth, then by source, or by source alone.
bool is_before(uint a, uint b, bool by_depth) {
    BlendedSample of_a = blended_samples[a - 1u];
    BlendedSample of_b = blended_samples[b - 1u];
    COUNT(WORDS, 8u);
    bool level = !by_depth || of_a.depth == of_b.depth;
    return level ? source_of(of_a) < source_of(of_b) : of_a.depth < of_b.depth;
}

// Sorts a list by merging runs of 1, 2, 4, … entries; returns its new head. Breaking out of the outer loop would
// disable lanes on llvmpipe (Mesa 22.3).
uint sorted(uint head, bool by_depth) {
    uint runs = 2u;
    for (uint size = 1u; runs > 1u; size *= 2u) {
        uint left = head;
        uint tail = 0u;
        head = 0u;
        runs = 0u;
        while (left != 0u) {
            runs++;
            uint right = left;
            uint of_left = 0u;
            while (of_left < size && right != 0u) {
                right = blended_samples[right - 1u].next;
                of_left++;
            }
            uint of_right = size;
            while (of_left > 0u || (of_right > 0u && right != 0u)) {
                bool takes_left = of_left > 0u && (of_right == 0u || right == 0u || !is_before(right, left, by_depth));
                uint taken = takes_left ? left : right;
                uint next = blended_samples[taken - 1u].next;
                left = takes_left ? next : left;
                right = takes_left ? right : next;
                of_left -= takes_left ? 1u : 0u;
                of_right -= takes_left ? 0u : 1u;
                if (tail == 0u) {
                    head = taken;
                } else {
                    blended_samples[tail - 1u].next = taken;
                }
                tail = taken;
            }
            left = right;
        }
        if (tail != 0u) {
            blended_samples[tail - 1u].next = 0u;
        }
    }
    return head;
}

// Joins adjacent entries of one triangle, with the nearest of their depths; returns the number of remaining entries.
uint joined(uint head) {
    uint count = 0u;
    uint last = 0u;
    for (uint entry = head; entry != 0u; entry = blended_samples[entry - 1u].next) {
        BlendedSample own = blended_samples[entry - 1u];
        if (last != 0u && blended_samples[last - 1u].seen == own.seen) {
            blended_samples[last - 1u].covered |= own.covered;
            blended_samples[last - 1u].depth = max(blended_samples[last - 1u].depth, own.depth);
            blended_samples[last - 1u].next = own.next;
        } else {
            last = entry;
            count++;
        }
    }
    return count;
}

void main() {
    uint width = uint(frame.image_size.x);
    uvec2 at = uvec2(gl_GlobalInvocationID.x, push.first + gl_GlobalInvocationID.y);
    uint place = at.y * width + at.x;
    uint head = at.x < width ? blended_heads[place] : 0u;
    head = sorted(head, false);
    uint count = joined(head);
    head = sorted(head, true);
    uint slot = take_slots(count);
    if (at.x < width) {
        COUNT(WORDS, 2u + 2u * count);
        blended_of_pixels[place] = uvec2(slot, count);
    }
    for (uint entry = head; entry != 0u; entry = blended_samples[entry - 1u].next) {
        BlendedSample own = blended_samples[entry - 1u];
        fragments[slot++] = fragment(at, own.covered, own.seen);
    }
    uint before = 0u; // samples that a nearer one covers
    for (uint k = 0u; k < count; k++) {
        slot--;
        uint covered = samples_of(fragments[slot]);
        fragments[slot].seen |= (covered & ~before) == 0u ? BEHIND : 0u;
        before |= covered;
    }
}
