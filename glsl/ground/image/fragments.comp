#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
//! with MULTISAMPLED
// Lists the fragments of a band's visible triangles. A thread per tile of pixels.

#include "common/count.glsl"
#include "ground/frame.glsl"

#define WRITES_FRAGMENTS
#include "ground/image/fragments.glsl"
#include "ground/image/seen_by_samples.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(push_constant) uniform Push {
    uint first; // rows relative to those that the band sees
    uint end;
} push;

// A thread reserves room for the pixels of a tile at once: CPU devices shade eight fragments at a time, which are then
// neighbours along both axes. One word has a bit for each sample of the tile.
const uvec2 TILE = uvec2(4u, 2u);
const uint TILE_PIXELS = TILE.x * TILE.y;

uvec2 pixel_at(uint k) {
    return (gl_GlobalInvocationID.xy * TILE + uvec2(0u, push.first)) + uvec2(k % TILE.x, k / TILE.x);
}

bool is_inside(uvec2 pixel) {
    return pixel.x < uint(frame.image_size.x) && pixel.y < push.end;
}

void main() {
    uint new = 0u; // the samples of a triangle that no earlier sample of their pixel sees
    for (uint k = 0u; k < TILE_PIXELS; k++) {
        uvec2 pixel = pixel_at(k);
        uint before[PIXEL_SAMPLES];
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            before[i] = is_inside(pixel) ? seen_by(pixel, i) : 0u;
            bool is_new = before[i] != 0u;
            for (uint j = 0u; j < i; j++) {
                is_new = is_new && before[j] != before[i];
            }
            new |= is_new ? 1u << (k * PIXEL_SAMPLES + i) : 0u;
        }
    }
    uint slot = take_slots(uint(bitCount(new)));
    for (uint k = 0u; k < TILE_PIXELS; k++) {
        uvec2 pixel = pixel_at(k);
        uint of_pixel = new >> (k * PIXEL_SAMPLES) & (1u << PIXEL_SAMPLES) - 1u;
        if (is_inside(pixel)) {
            pixel_fragments[pixel.y * uint(frame.image_size.x) + pixel.x] =
                slot << COUNT_BITS | uint(bitCount(of_pixel));
            COUNT(WORDS, 2u * PIXEL_SAMPLES + 1u + 2u * uint(bitCount(of_pixel)));
        }
        uint ids[PIXEL_SAMPLES];
        for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
            ids[i] = of_pixel != 0u ? seen_by(pixel, i) : 0u;
        }
        for (uint left = of_pixel; left != 0u; left &= left - 1u) {
            uint id = ids[findLSB(left)];
            uint covered = 0u;
            for (uint i = 0u; i < PIXEL_SAMPLES; i++) {
                covered |= ids[i] == id ? 1u << i : 0u;
            }
            fragments[slot++] = fragment(pixel, covered, id);
        }
    }
}
