// What the steps to the clearance leave for each other: rows of bits, and two numbers per brick.

#include "common/count.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 20, scalar) buffer Scratch { uint scratch[]; };

const int WORD_VOXELS = int(EDGE < 32u ? EDGE : 32u); // along x
const int WORDS_PER_ROW = int(EDGE) / WORD_VOXELS;
const int ROW_WORDS = int(EDGE * EDGE) * WORDS_PER_ROW;
const int BRICKS = int(EDGE / BRICK); // along an edge of the grid

// Which voxels of a word list something; outside of the grid none does.
uint row_bits(int word, int y, int z) {
    bool inside = all(greaterThanEqual(ivec3(word, y, z), ivec3(0)))
        && all(lessThan(ivec3(word, y, z), ivec3(WORDS_PER_ROW, EDGE, EDGE)));
    COUNT(WORDS, inside ? 1u : 0u);
    return inside ? scratch[(z * int(EDGE) + y) * WORDS_PER_ROW + word] : 0u;
}

int brick_entry(int which, ivec3 brick) {
    return ROW_WORDS + ((which * BRICKS + brick.z) * BRICKS + brick.y) * BRICKS + brick.x;
}
